"""The study of melting, from piles that were laid by hand and lost a known part of themselves."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from synthetic.released import stack, write_released

from dem.errors import InputError
from dem.record.manifest import read_run
from postprocess.measures.spread import centre_of_mass
from postprocess.statistics.columns import SEED
from studies.framework.procedures import PROCEDURE
from studies.melting import figures as melting_figures
from studies.melting.measure import (
    BASE,
    CONTACT,
    HEIGHT,
    LIFT,
    OFFSET,
    SINCE,
    SLOUGHED,
    SPREAD,
    TILT,
    TOPPLED,
    measure_melting,
)
from studies.melting.study import Melting

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study melting --out melting"}
AWAY = np.array([0.05, 0.0, 0.0])


def shed(pile, count):
    """The topmost smarticles lie far outside, apart from each other."""
    left = pile.copy()
    for k in range(1, count + 1):
        left[-k] = pile[0] + k * AWAY
    return left


def sunk(pile, share):
    return pile * np.array([1.0, 1.0, share])


def fallen(pile):
    """Turned onto its side about a line in the floor, 20 mm from the axis."""
    edge = np.array([0.02, 0.0, 0.0])
    turned = Rotation.from_euler("y", 90, degrees=True).apply((pile - edge).reshape(-1, 3))
    return turned.reshape(pile.shape) + edge


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    root, pile, runs = tmp_path_factory.mktemp("melting"), stack(), []
    for seed in (1, 2, 3):
        made = {
            "static": sunk(pile, 0.7 + 0.01 * seed),
            "internal": shed(pile, 2 + seed % 2),
            "shape-change": fallen(pile) if seed == 2 else sunk(pile, 0.99),
        }
        for procedure, after in made.items():
            directory = root / f"{procedure}_lw0.70_seed{seed}"
            runs.append(write_released(directory, procedure, before=pile, after=after, seed=seed))
        lifted = root / f"internal_lifted_lw0.70_seed{seed}"
        runs.append(write_released(lifted, "internal", before=pile, after=sunk(pile, 0.9), seed=seed, lift=0.1))
    return root, runs


@pytest.fixture(scope="module")
def report(study):
    root, runs = study
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(melting_figures, "draw_strip", lambda rows, output, **_: output)
        return root / "out", Melting().analyse([*runs, root / "absent"], root / "out", **ORIGIN)


def test_a_run_is_measured_against_time_from_when_the_wall_went(study):
    melted = measure_melting(read_run(study[0] / "internal_lw0.70_seed1"))
    assert melted.history[SINCE] == pytest.approx([0, 0.5, 1, 1.5, 2])
    assert melted.history[SLOUGHED].tolist() == [0, 0, 0.3, 0.3, 0.3]
    assert melted.history[CONTACT].tolist() == [1, 1, 0.7, 0.7, 0.7]
    assert melted.history[HEIGHT][0] == 1
    assert melted.history[SPREAD][-1] > 5
    assert melted.row[SLOUGHED] == 0.3
    assert melted.row[LIFT] == 0


def test_a_pile_that_fell_over_is_told_from_one_that_sank(study):
    over, sank = (measure_melting(read_run(study[0] / f"shape-change_lw0.70_seed{seed}")).row for seed in (2, 1))
    assert (over[TOPPLED], sank[TOPPLED]) == (1, 0)
    height = centre_of_mass(stack())[2]
    # Turned about the edge, the centre of mass came from (0, h) to (20 mm + h, 20 mm).
    assert over[OFFSET] * over[BASE] == pytest.approx(0.02 + height)
    assert over[TILT] == pytest.approx(np.degrees(np.arctan2(0.02 + height, 0.02)))
    assert sank[TILT] == pytest.approx(0, abs=1e-6)
    assert sank[HEIGHT] == pytest.approx(0.99)
    assert (over[CONTACT], sank[CONTACT]) == (1, 1)


def test_the_study_judges_what_the_paper_says(report):
    output, found = report
    verdicts = {one.paper: one.verdict for one in found.judged}
    assert verdicts["Shape change: the pile does not break apart"] == "found"
    assert verdicts["Internal oscillation: some smarticles slough off the outer edge"] == "found"
    edge = next(one for one in found.judged if "do not come off" in one.paper)
    assert edge.verdict == "found"
    assert "less internal -0.267 ± 0.0333 (n = 3)" in edge.ours
    topples = next(one for one in found.judged if "onto its side" in one.paper)
    assert (topples.verdict, topples.ours[:18]) == ("found", "1 of 3 fell over; ")
    # Before the wall goes all piles are the same: nothing is narrower, higher or lower.
    assert verdicts["Shape change narrows the base and raises the pile"] == "not resolved"
    lifted = found.judged[-1]
    assert lifted.verdict == "found"
    assert "internal sloughed -0.267" in lifted.ours
    table = pd.read_csv(output / "runs.csv", comment="#")
    assert table[[LIFT, SEED, PROCEDURE]].to_numpy().tolist()[:3] == [
        [0, 1, "static"],
        [0, 1, "internal"],
        [0, 1, "shape-change"],
    ]
    missing = pd.read_csv(output / "missing.csv", comment="#")
    assert missing["status"].tolist() == ["not started"]
    times = pd.read_csv(output / "times.csv", comment="#")
    assert len(times) == 12 * 5
    assert json.loads((output / "provenance.json").read_text())["study"] == "melting"
    assert {"time_lw0.70.png", "time_lw0.70_lifted.png", "pictures.png"} <= set(found.files)


def test_few_that_stand_do_not_prove_that_none_falls(study, tmp_path, undrawn):
    runs = [study[0] / f"{name}_lw0.70_seed1" for name in ("static", "shape-change")]
    found = {one.paper: one for one in Melting().analyse(runs, tmp_path, **ORIGIN).judged}
    topples = found["Shape change: the pile may fall onto its side (one example is shown)"]
    assert topples.verdict == "not resolved"
    assert "0 of 1 fell over, so at most 95% of such piles do" in topples.ours
    assert found["Internal oscillation: some smarticles slough off the outer edge"].verdict == "no data"


def test_runs_that_are_no_melting_are_listed(study, tmp_path, undrawn):
    good = study[0] / "static_lw0.70_seed1"
    bad = write_released(tmp_path / "walled", "static", before=stack(), after=stack())
    for file in ("run.json", "done.json"):
        path = bad / file
        path.write_text(path.read_text().replace("remove-container", "relax"))
    report = Melting().analyse([good, bad], tmp_path / "out", **ORIGIN)
    missing = pd.read_csv(report.files["missing.csv"], comment="#")
    assert "does not end with a rest and remove-container" in missing["cause"].iloc[0]
    with pytest.raises(InputError, match="with seed 1 is given twice"):
        Melting().analyse([good, good], tmp_path / "out", **ORIGIN)
