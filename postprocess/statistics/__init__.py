"""Means, errors and comparisons: of numbers, with no idea of what they measure. On NumPy, SciPy and pandas alone."""
