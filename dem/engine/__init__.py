"""Engines, which are running simulations behind one interface."""

ENGINES = ("yade", "links", "lammps")  #: Names of the engines, the default first
