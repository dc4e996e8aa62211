"""Shipped sweeps with their analysis."""
