"""Random extreme scenes, and a checker of their runs that shares no code with the engines."""
