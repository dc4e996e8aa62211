"""The study fracture."""
