"""Figures, tables and texts on disk."""
