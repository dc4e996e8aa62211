"""From runs at many steps to where chatter and blow-up begin; no YADE."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from validation.engines import engine_access
from validation.hard.onset import SETTINGS, onsets

STACK = "welded stack, l/w = 0.7, draft"
PILE = "welded pile, l/w = 0.7, draft"


def rows(scene: str, seed: int, *looks: tuple[float, float, float]) -> pd.DataFrame:
    """Factor, speed [m/s] and energy from nowhere of each run."""
    table = pd.DataFrame(
        looks,
        columns=[
            "factor [1]",
            "speed at rest, root mean square [m/s]",
            "energy from nowhere over lifting by d [1]",
        ],
    )
    return table.assign(**{"scene": scene, "seed": seed, "stable step [s]": 1e-4})


def test_least_and_most_over_seeds() -> None:
    runs = pd.concat(
        [
            rows(
                STACK, 1, (0.5, 1e-9, 0.0), (0.9, 1e-8, 0.01), (1.0, 2e-3, 0.0), (1.5, 1e-2, 0.9), (2.0, math.nan, 5.0)
            ),
            rows(STACK, 2, (0.5, 1e-9, 0.0), (0.9, 1e-6, 0.02), (1.0, 1e-8, 0.0), (1.5, math.nan, math.inf)),
            rows(PILE, 1, (0.5, 1e-2, 0.0), (0.9, 1e-2, 0.0), (4.0, 1e-2, 0.0)),
        ]
    )
    stack, pile = onsets(runs).to_dict("records")
    assert (stack["chatter from, least [1]"], stack["chatter from, most [1]"]) == (1.0, 1.5)
    assert (stack["blow-up from, least [1]"], stack["blow-up from, most [1]"]) == (1.5, 2.0)
    assert stack["speed at rest at 0.9 or less, most [m/s]"] == 1e-6
    assert stack["energy from nowhere at 0.9 or less over lifting by d, most [1]"] == 0.02
    assert math.isnan(pile["chatter from, least [1]"])
    assert pile["blow-up from, least [1]"] == math.inf


@pytest.mark.parametrize("name", SETTINGS)
def test_every_setting_is_a_valid_scene(name: str) -> None:
    assert SETTINGS[name].data(engine_access("links"))["count"] == SETTINGS[name].count
