"""The study of casting, from piles that were laid by hand into a mould."""

import math

import numpy as np
import pandas as pd
import pytest
from synthetic.released import stack, write_released

from dem.errors import InputError
from dem.record.manifest import read_run
from postprocess.measures.mould import read_tiers
from studies.casting import figures as casting_figures
from studies.casting.measure import (
    FILLED,
    FILLED_AFTER,
    HEIGHT,
    KEPT,
    MATERIAL,
    MATERIAL_AFTER,
    NECK,
    OVERLAP,
    WHOLE,
    WHOLE_KEPT,
    casting_row,
)
from studies.casting.study import Casting
from studies.framework.procedures import PROCEDURE

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study casting --out casting"}
MOULD = [
    {"radius_m": 0.012, "height_m": 0.006},
    {"radius_m": 0.0108, "height_m": 0.006},
    {"radius_m": 0.0096, "height_m": 0.006},
    {"radius_m": 0.0096, "height_m": 0.1},
]


def crossed(count, bottom=0.0):
    """U-shapes on each other, each turned by a right angle against the one below."""
    pile = stack(count, 0.8)
    pile[1::2] = pile[1::2] @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    return pile + np.array([0.0, 0.0, bottom])


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    root, made = tmp_path_factory.mktemp("casting"), []
    upright = crossed(14)
    for seed in (1, 2):
        low = crossed(9 + seed)
        for procedure, before, after in (
            ("static", low, low),
            ("internal", upright, low),
            ("shape-change", low, low + np.array([0.001 * seed, 0, 0])),
        ):
            count = len(upright)
            piles = [np.concatenate([pile, pile])[:count] for pile in (before, after)]
            name = root / f"{procedure}_seed{seed}"
            kept = {"before": piles[0], "after": piles[1], "seed": seed, "tiers": MOULD, "aspect_ratio": 0.8}
            made.append(write_released(name, procedure, **kept))
    return made


def test_the_mould_is_the_tiers_below_the_neck(runs):
    tiers = read_tiers(runs[0])
    assert [(tier.radius, tier.bottom, tier.top) for tier in tiers] == [
        (0.012, 0.0, 0.006),
        (0.0108, 0.006, pytest.approx(0.012)),
        (0.0096, pytest.approx(0.012), pytest.approx(0.018)),
        (0.0096, pytest.approx(0.018), pytest.approx(0.118)),
    ]


def test_a_run_tells_what_each_tier_holds_before_and_after(runs):
    row = casting_row(read_run(runs[1]))  # 14 levels of 1.27 mm before, 17.8 mm; 10 after, 12.7 mm
    material = [row[name] for name in MATERIAL.values()]
    # Centrelines lie at 0.635, 1.905 … mm: five of them below 6 mm, four below 12 and five below 18 mm.
    assert material == pytest.approx([5 / 14, 4 / 14, 5 / 14])
    assert row[NECK] == pytest.approx(0)
    # Four of the fourteen were laid a second time into the lowest levels.
    after = [row[name] for name in MATERIAL_AFTER.values()]
    assert after == pytest.approx([9 / 14, 4 / 14, 1 / 14])
    assert row[FILLED_AFTER["upper"]] < 0.3 * row[FILLED["upper"]]
    assert row[KEPT["lower"]] == pytest.approx(1, abs=0.02)
    assert row[KEPT["upper"]] == pytest.approx(row[FILLED_AFTER["upper"]] / row[FILLED["upper"]], rel=0.02)
    assert row[WHOLE_KEPT] == pytest.approx(row[OVERLAP], abs=0.05)  # nothing lies outside the mould
    assert row[HEIGHT] == pytest.approx(13.5 * 1.27e-3, rel=0.05)
    still = casting_row(read_run(runs[0]))
    assert (still[OVERLAP], still[WHOLE_KEPT]) == (1, 1)


def test_of_a_tier_that_holds_less_than_the_ball_no_share_is_told(tmp_path):
    pile = crossed(9)  # 11.4 mm high: all in the lower two tiers
    upright = pile[-1:].copy()
    upright[..., 2] = 0.0115 + np.array([0.005, 0, 0, 0.005])  # but for the ends of two barbs
    pile = np.concatenate([pile, upright])
    made = write_released(tmp_path, "static", before=pile, after=pile, tiers=MOULD, aspect_ratio=0.8)
    row = casting_row(read_run(made))
    assert 0 < row[FILLED["upper"]] < 0.05
    assert (row[KEPT["lower"]], row[KEPT["middle"]], row[WHOLE_KEPT]) == (1, 1, 1)
    assert math.isnan(row[KEPT["upper"]])


def test_the_study_compares_procedures_by_pairs(runs, tmp_path, monkeypatch):
    monkeypatch.setattr(casting_figures, "draw_strip", lambda rows, output, **_: output)
    report = Casting().analyse([*runs, tmp_path / "absent"], tmp_path / "out", **ORIGIN)
    table = pd.read_csv(report.files["points.csv"], comment="#")
    assert table[PROCEDURE].tolist() == ["static", "internal", "shape-change"]
    assert table[WHOLE].iloc[1] > table[WHOLE].iloc[0]
    verdicts = {one.paper: one.verdict for one in report.judged}
    assert verdicts["The mould is filled by pouring (shown in a picture)"] == "not found"
    assert {"tiers.png", "overlap.png", "pictures.png"} <= set(report.files)
    text = report.files["findings.md"].read_text()
    assert "assumed: the paper gives none" in text


def test_runs_of_other_moulds_are_refused(runs, tmp_path, undrawn):
    pile = crossed(14)
    kept = {"before": pile, "after": pile, "seed": 3, "aspect_ratio": 0.8}
    plain = write_released(tmp_path / "plain", "static", **kept)
    report = Casting().analyse([runs[0], plain], tmp_path / "out", **ORIGIN)
    missing = pd.read_csv(report.files["missing.csv"], comment="#")
    assert "a mould has 3 tiers and a neck: container.tiers has 0" in missing["cause"].iloc[0]
    wider = [{**tier, "radius_m": 2 * tier["radius_m"]} for tier in MOULD]
    other = write_released(tmp_path / "wider", "static", **kept, tiers=wider)
    with pytest.raises(InputError, match="runs of different mould must not be averaged"):
        Casting().analyse([runs[0], other], tmp_path / "out", **ORIGIN)
    bad = write_released(tmp_path / "bad", "static", **kept, tiers=[{"radius_m": 0.01, "height_m": -1}])
    with pytest.raises(InputError, match=r"container.tiers.0.height_m must be a finite number above 0: got -1"):
        read_tiers(bad)
