"""Hands on a simulation, for each engine: what a case does that no run ever does, behind one interface."""
