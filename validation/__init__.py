"""Validate the engines against theory and on difficult cases, as pytest suites; not installed.

- `known`: simulations with analytic or independently integrated answers, and convergence orders.
- `hard`: difficult scenes, which must finish or stop with an error that names the cause; runs that are killed and
  resumed; time steps at which instability begins.
- `extremes`: random extreme scenes, and a checker that shares no code with the engines.
- `access`: test access to the internals of engines.

`--results DIR` writes the measured tables.
"""
