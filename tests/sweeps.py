"""Sweeps for tests: shipped ones, made smaller."""

from dataclasses import replace

from templates.sweep.sweep_file import Sweep


def of_one_seed(sweep: Sweep) -> Sweep:
    """The same with the first of its seeds alone, and nothing again: what is so of one is so of all."""
    repeats = sweep.content.repeats
    assert repeats is not None
    first = repeats.model_copy(update={"seeds": repeats.seeds[:1], "more": None})
    return replace(sweep, content=sweep.content.model_copy(update={"repeats": first, "again": None}))
