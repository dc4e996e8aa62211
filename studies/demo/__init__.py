"""Draw and describe the runs of `make demo`."""
