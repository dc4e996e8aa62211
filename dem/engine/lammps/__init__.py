"""The engine on LAMMPS: chains of spheres on several processors and nodes, in a child process."""
