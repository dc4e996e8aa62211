"""Kernels of forces: links on links, fixtures and strings on links."""
