"""Means, errors and comparisons of numbers, by NumPy, SciPy and pandas alone."""
