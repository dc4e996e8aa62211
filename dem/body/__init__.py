"""Geometry, spheres, poses and states of smarticles, independent of scenes and engines."""
