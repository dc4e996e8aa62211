"""The stability suite: cases that are hard on the engine end right, or in an error that says why; never in nonsense.

Each case is defined once (`smarticles.verification.hard.cases`) with two sizes: the short one is a test of continuous
integration (`tests/engine/test_hard_cases.py`), the long one is run by `make stability`, which writes a table of what
was checked.
"""
