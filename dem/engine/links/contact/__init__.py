"""Kernels of forces: links on links, boundaries and strings on links."""
