"""Compute sweeps through Slurm, a batch system."""
