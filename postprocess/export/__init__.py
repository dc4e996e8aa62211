"""True bodies of runs with their fields, as files for other programs."""
