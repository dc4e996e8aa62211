"""Kernels of forces on links: from other links, boundaries and strings."""
