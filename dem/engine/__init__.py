"""The running simulation behind one interface."""

ENGINES = ("yade", "links", "lammps")  #: Names of the engines, the default first; `dem.engine.kinds` makes them
