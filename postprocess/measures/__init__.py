"""Measures of frames and series, one file each, and tables of their values.

A file registers its measures in its tuple `MEASURES`.
"""
