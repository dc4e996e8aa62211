"""Scenes: their model, checks, reading and hashing."""
