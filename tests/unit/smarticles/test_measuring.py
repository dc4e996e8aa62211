"""Means over runs of several sweeps, in memory."""

import math

import pandas as pd
import pytest

from smarticles.measuring import group_columns, grouped

H = "height [m]"


@pytest.mark.parametrize("by", [["friction"], ["friction", "law"]])
def test_a_variable_that_other_sweeps_lack_makes_a_group_of_theirs(by: list[str]) -> None:
    table = pd.DataFrame(
        {
            "run": ["a", "b", "c", "d"],
            "state": ["done", "done", "running", "done"],
            "friction": [0.4, 0.4, math.nan, math.nan],
            "law": ["free", "free", None, None],
            "phase": 0,
            "phase type": "relax",
            H: [1.0, 2.0, 3.0, 5.0],
        }
    )
    means = grouped(table, by)
    assert means["state"].tolist() == ["2 of 2 finished", "1 of 2 finished"]
    assert means[H].tolist() == [1.5, 5.0]
    assert group_columns(means, by) == [*by, "runs [-]", "state"]
    assert grouped(table, by, unfinished=True)[H].tolist() == [1.5, 4.0]
