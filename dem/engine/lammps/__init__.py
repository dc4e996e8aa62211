"""LAMMPS as an engine: sphere chains on several processors and nodes, a child process that is told what to do."""
