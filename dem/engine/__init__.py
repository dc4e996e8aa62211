"""Engines, which are running simulations behind one interface."""

ENGINES = ("links", "yade", "lammps")  #: Names of the engines, the default first
