"""Geometry of smarticles from their vertices alone, without frames and runs."""
