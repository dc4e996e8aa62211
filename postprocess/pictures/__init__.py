"""Draw pictures and films of runs."""
