"""LAMMPS as an engine: sphere chains on several processors and nodes, in a child process."""
