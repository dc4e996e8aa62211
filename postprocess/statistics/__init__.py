"""Means, errors and comparisons."""
