"""Template engine: sweeps become run directories, run directories become results."""
