"""Validation against theory and on hard cases; pytest suites beside the installed packages.

`known`: simulations whose answer is on paper, and convergence orders. `hard`: cases that must end right, or in an error
that names the cause; kills and resumes; onset of instability. `engines`: test access to an engine's internals.
`--results DIR` writes the measured tables.
"""
