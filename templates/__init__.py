"""Make and compute sweeps: run directories from a template, on this machine or through Slurm."""
