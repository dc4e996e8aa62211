"""Means with errors, comparisons and fits, by NumPy, SciPy and pandas alone."""
