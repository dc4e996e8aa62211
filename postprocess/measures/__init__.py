"""Pure functions of frames and series."""
