"""Simulation of a scene into a run directory."""
