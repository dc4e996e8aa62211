"""The links engine: links as swept segments, hinges driven by motors, kernels compiled by Numba."""
