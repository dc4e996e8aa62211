"""Validation against theory and on hard cases; pytest suites beside the installed packages.

`known`: simulations whose answer is on paper, and convergence orders. `hard`: cases that must end well, or with an
error that names the cause; kills and resumes; onset of instability. `extremes`: random extreme scenes, and a checker
that shares no code with the engines. `access`: an engine's internals. `--results DIR` writes the measured tables.
"""
