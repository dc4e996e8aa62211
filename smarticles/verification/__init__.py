"""One bench for what must come out: known answers, and hard cases that end right or in an error that says why.

`known` has small simulations whose answer is on paper, and ladders over the time step, which tell the order of the
scheme; `smarticles verify` runs them all. `hard` has cases that are hard on the engine, each in two sizes: the short
one is a test of continuous integration (`tests/engine/test_hard_cases.py`), the long one is run by `make stability`.

A case (`case.py`) gives checks (`check.py`): an `Answer` where theory has one. All are built on `bench.py`, through the
engine that users run; tables are computed where YADE is, judged and drawn in another process.
"""
