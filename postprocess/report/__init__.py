"""Figures, tables and texts on disk. On statistics alone; pictures are drawn with it, never the other way."""
