"""Whether the force that tears a pile goes with its entanglement, on tables."""

from __future__ import annotations

import pandas as pd
import pytest

from postprocess.statistics.bounded import goes_with

WORDS = {"unit": "n W_s per link", "called": "peaks"}


def table(peaks: list[float]) -> pd.DataFrame:
    """Eight seeds of piles with one to four links each, and the peaks told."""
    rows = [(seed, links, peak) for seed in range(8) for links, peak in zip((1.0, 2.0, 3.0, 4.0), peaks, strict=True)]
    return pd.DataFrame(rows, columns=["seed", "crossings", "peak"]).assign(held=0.0)


def test_with_it_against_it_and_neither() -> None:
    for peaks, verdict in (([1, 2, 3, 9], "found"), ([9, 3, 2, 1], "not found"), ([2, 9, 1, 3], "not resolved")):
        runs = table([float(peak) for peak in peaks])
        runs["peak"] += 0.7 * (runs["seed"] % 3)
        runs.loc[runs["seed"] == 0, "peak"] *= -1
        told, found = goes_with(runs["crossings"], runs["peak"], runs["held"], runs["seed"].tolist(), **WORDS)
        assert found == verdict, told


def test_what_held_fast_is_above_all_that_did_not() -> None:
    """Whatever its bound is: here below what the others took."""
    runs = table([2.0, 3.0, 4.0, 1.0])
    before, _ = goes_with(runs["crossings"], runs["peak"], runs["held"], runs["seed"].tolist(), **WORDS)
    assert before.startswith("rank correlation -0.2 ")
    runs.loc[runs["crossings"] == 4, "held"] = 1.0
    told, found = goes_with(runs["crossings"], runs["peak"], runs["held"], runs["seed"].tolist(), **WORDS)
    assert told.startswith("rank correlation +1 ")
    assert told.endswith(", 8 of the peaks lower bounds")
    assert found == "found"


@pytest.mark.parametrize("seeds", [0, 5])
def test_too_few_seeds_tell_nothing(seeds: int) -> None:
    runs = table([1.0, 2.0, 3.0, 9.0])
    runs = runs[runs["seed"] < seeds]
    _, found = goes_with(runs["crossings"], runs["peak"], runs["held"], runs["seed"].tolist(), **WORDS)
    assert found == ("not resolved" if seeds else "no data")
