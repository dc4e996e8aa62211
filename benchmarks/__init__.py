"""Measure what a simulated second costs, and how the cost grows."""
