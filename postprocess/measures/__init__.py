"""Measures of frames and series, and tables of them; one file each, registered by its tuple `MEASURES`.

They know nothing of reports and pictures.
"""
