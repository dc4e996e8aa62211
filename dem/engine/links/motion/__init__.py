"""Kernels of motion: the plane geometry of a smarticle, poses, motors, and the motion in a step."""
