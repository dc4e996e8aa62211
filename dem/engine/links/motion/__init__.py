"""Kernels of motion: the plane geometry of a smarticle, its pose, its motors, its steps."""
