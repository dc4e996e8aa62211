"""The links engine: links as swept segments, motors as prescribed motion, kernels compiled by Numba."""
