"""The study of collapse, from run directories of columns whose collapse time is known."""

import json
import math

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from synthetic.columns import H0, PHASES, WITH_WALL, Column, F, write_column

from dem.errors import InputError
from dem.record.manifest import read_run
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from studies.base.collapse.column import COM, CORE, DEFINITIONS, REMAINING, column_history, period_means, vibration
from studies.collapse.findings import findings
from studies.collapse.law import (
    ACTIVATION,
    AT_LEAST,
    CENSORED,
    ERROR,
    HALF_WIDTH,
    REFERENCE,
    USED,
    activations,
    check_law,
    levels,
    slope_through_origin,
)
from studies.collapse.measure import (
    DEFINITION,
    DELTA,
    GAMMA,
    HEIGHT_BEFORE,
    HEIGHT_WITH,
    LOG,
    STANDS,
    TIME,
    collapse_rows,
)
from studies.collapse.reference import read_collapse_reference, reference_delta
from studies.collapse.study import Collapse

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study collapse --out 'my study'"}
DELTAS = {0.13: 6.0, 0.40: 9.0, 1.02: 7.5}
SPREAD = {1: 0.98, 2: 1.0, 3: 1.02}


def tau(delta, gamma):
    return math.exp(delta / gamma) / F


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    return read_run(write_column(tmp_path_factory.mktemp("one") / "run", Column(tau=0.8, beta=0.8)))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Three aspect ratios, two accelerations, three seeds, exactly as the law says; one run failed."""
    root = tmp_path_factory.mktemp("study")
    runs = []
    for seed, factor in SPREAD.items():
        for aspect, delta in DELTAS.items():
            for gamma in (2.5, 4.0):
                status = "failed" if (seed, aspect, gamma) == (3, 0.13, 4.0) else "done"
                column = Column(
                    tau=tau(factor * delta, gamma), aspect_ratio=aspect, gamma=gamma, seed=seed, status=status
                )
                runs.append(write_column(root / f"lw{aspect}_gamma{gamma}_seed{seed}", column))
    return root, runs, Collapse().analyse(runs, root / "out", **ORIGIN)


def test_each_height_is_one_before_and_falls_as_it_was_made_to(one):
    shaken = vibration(one)
    assert (shaken.acceleration, shaken.frequency, shaken.phase.index) == (2.5, F, 4)
    before = {REMAINING: 1.0, COM: H0, CORE: H0}
    for definition in DEFINITIONS:
        history = column_history(one, definition, shaken)
        assert history.before == pytest.approx(before[definition])
        assert history.heights[history.times < 0] == pytest.approx(1)
        end = np.exp(-((3 / 0.8) ** 0.8)) if definition == REMAINING else 0.4
        assert history.heights[-1] == pytest.approx(end, abs=0.02)


def test_each_definition_gives_its_own_time(one):
    rows = pd.DataFrame(collapse_rows(one)).set_index(DEFINITION)
    # Whole smarticles leave, of 50, and frames are 0.1 s apart.
    assert rows.loc[REMAINING, TIME] == pytest.approx(0.8, rel=0.02)
    assert rows.loc[COM, TIME] == pytest.approx(0.4, rel=0.02)
    assert rows.loc[CORE, TIME] == pytest.approx(0.4, rel=0.02)
    assert rows.loc[REMAINING, LOG] == pytest.approx(math.log(F * rows.loc[REMAINING, TIME]))
    assert rows.loc[REMAINING, DELTA] == pytest.approx(2.5 * rows.loc[REMAINING, LOG])
    assert rows.loc[REMAINING, HEIGHT_BEFORE] == pytest.approx(H0)
    assert rows.loc[REMAINING, HEIGHT_WITH] == pytest.approx(WITH_WALL * H0)
    assert rows.loc[REMAINING, STANDS] == 1


def test_a_mean_over_a_period_does_not_see_the_bouncing_within():
    times = np.arange(-40, 400) * 0.005
    at, means = period_means(times, np.where(times > 0, 1 + np.sin(2 * np.pi * F * times), 7.0), F)
    assert len(at) == math.ceil(399 * 0.005 * F)
    assert np.abs(means - 1).max() < 0.2  # 6 or 7 samples of a period
    assert abs(means.mean() - 1) < 0.01
    assert np.diff(at) == pytest.approx(1 / F, abs=0.0051)


def test_delta_is_that_put_in(study):
    table = pd.read_csv(study[0] / "out" / "points.csv", comment="#").set_index([DEFINITION, ASPECT])
    for aspect, delta in DELTAS.items():
        row = table.loc[(REMAINING, aspect)]
        # Whole smarticles leave: τ is known to 2 %, Δ to 0.02 Γ.
        assert row[ACTIVATION] == pytest.approx(delta, abs=0.08)
        assert row[REFERENCE] == reference_delta(aspect)
        assert row[CENSORED] == 0
        assert row[USED] == "2.5 4"
        # The seed whose run at Γ = 4 failed does not count.
        seeds = 2 if aspect == 0.13 else 3
        assert row[SEEDS] == seeds
        expected = np.std([factor * delta for factor in list(SPREAD.values())[:seeds]], ddof=1) / math.sqrt(seeds)
        assert row[ERROR] == pytest.approx(expected, abs=0.05)
        assert row[HALF_WIDTH] == pytest.approx({2: 12.706205, 3: 4.302653}[seeds] * row[ERROR], rel=1e-3)


def test_findings_of_a_study_that_obeys_the_law(study):
    verdicts = {finding.paper: finding.verdict for finding in study[2].judged}
    assert verdicts == {
        "Columns collapse the later the gentler the vibration": "found",
        "τ = (1/f) exp(Δ/Γ) with one Δ at each l/w": "found",
        "Δ is greatest at an intermediate l/w, near 0.4": "found",
        "Δ as measured": "not found",  # 9 is not 15
    }


def test_files_say_where_they_come_from(study):
    root, _, report = study
    out = root / "out"
    for name in ("height_time", "time_acceleration", "delta_aspect"):
        with Image.open(out / f"{name}.png") as image:
            assert np.asarray(image.convert("L")).std() > 10
        assert {f"{name}.png", f"{name}.svg"} <= set(report.files)
    assert json.loads((out / "provenance.json").read_text())["reference"]["file"] == "gravish2012_collapse.csv"
    text = (out / "findings.md").read_text()
    assert "17 of 18 runs, 1 missing" in text
    assert "lw0.13_gamma4.0_seed3 | failed | a smarticle escaped" in text
    assert "The floor has no end" in text
    assert len(report.rows) == len(DELTAS)
    assert report.rows[0][0] == "0.13"


def table_of(times, *, bounds=()):
    """Rows by `REMAINING` of {(aspect, gamma): times of seeds}; keys in `bounds` did not collapse."""
    rows = []
    for (aspect, gamma), seeds in times.items():
        for seed, time in enumerate(seeds, 1):
            log = math.log(F * time)
            what = {ASPECT: aspect, GAMMA: gamma, SEED: seed, LOG: log, DELTA: gamma * log}
            what[TIME] = math.nan if (aspect, gamma, seed) in bounds else time
            rows += [{DEFINITION: name, **what} for name in DEFINITIONS]
    return pd.DataFrame(rows)


def test_a_run_that_did_not_collapse_is_a_bound_and_never_dropped():
    times = {(0.4, gamma): [tau(factor * 9, gamma) for factor in (0.9, 1.0, 1.1)] for gamma in (2.0, 4.0)}
    slow = (0.4, 2.0)
    watched = tau(9, 2.0)
    times[slow] = [min(time, watched) for time in times[slow]]
    found = table_of(times, bounds={(0.4, 2.0, 2), (0.4, 2.0, 3)})
    level = levels(found).set_index([DEFINITION, GAMMA])
    assert level.loc[(REMAINING, 2.0), CENSORED] == 2
    assert level.loc[(REMAINING, 2.0), DELTA] == pytest.approx(9 * (0.9 + 1 + 1) / 3)
    assert math.isnan(level.loc[(REMAINING, 2.0), "ln(f tau) SE [-]"])
    row = activations(found).iloc[0]
    # The one seed that collapsed at Γ = 2 is not taken for all: Δ is that of Γ = 4, beside the bound.
    assert row[ACTIVATION] == pytest.approx(9)
    assert (row[CENSORED], row[USED]) == (2, "4")
    assert row[AT_LEAST] == pytest.approx(8.7)


def test_without_any_collapse_there_is_only_a_bound():
    found = table_of({(0.4, 2.5): [3.0, 3.0, 3.0]}, bounds={(0.4, 2.5, seed) for seed in (1, 2, 3)})
    row = activations(found).iloc[0]
    assert math.isnan(row[ACTIVATION])
    assert row[AT_LEAST] == pytest.approx(2.5 * math.log(90))
    assert {finding.verdict for finding in findings(found)} == {"no data"}


def test_times_that_do_not_obey_the_law_are_told():
    # τ hardly depends on Γ: Γ ln(fτ) grows with Γ by 46 %.
    times = {(0.4, gamma): [0.9, 1.0, 1.1] for gamma in (2.5, 4.0)}
    found = table_of(times)
    assert check_law(found, REMAINING).change.value == pytest.approx((4 - 2.5) / 3.25, rel=0.01)
    verdicts = [finding.verdict for finding in findings(found)]
    assert verdicts[:2] == ["not resolved", "not found"]
    slower = table_of({(0.4, 2.5): [0.9, 1.0, 1.1], (0.4, 4.0): [1.9, 2.0, 2.1]})
    assert findings(slower)[0].verdict == "not found"


def test_a_maximum_at_an_end_is_not_found():
    times = {
        (aspect, 2.5): [tau(factor * delta, 2.5) for factor in (0.99, 1, 1.01)]
        for aspect, delta in {0.13: 6.0, 0.4: 9.0, 1.02: 10.0}.items()
    }
    assert findings(table_of(times))[2].verdict == "not found"
    assert findings(table_of({key: value for key, value in times.items() if key[0] != 0.13}))[2].verdict == "no data"


def test_a_line_through_the_origin():
    assert slope_through_origin([0.25, 0.4], [2.5, 4.0]) == pytest.approx(10)
    assert slope_through_origin([1, 2], [0, 5]) == pytest.approx(2)


def test_the_reference_has_its_peak_and_is_not_interpolated():
    reference = read_collapse_reference()
    assert len(reference) == 9
    assert reference.loc[reference["delta"].idxmax(), "l_over_w"] == 0.4
    assert reference_delta(0.4) == 15
    assert math.isnan(reference_delta(0.41))


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (
            [Column(tau=0.5, phases=("deposit", "shake", "relax"))],
            "study collapse: none of 1 runs is done; the first: ",
        ),
        ([Column(tau=0.5), Column(tau=0.6, gamma=4.0, frequency=20.0)], "study collapse: runs of different frequency"),
        ([Column(tau=0.5), Column(tau=0.6, gamma=4.0, count=40)], "study collapse: runs of different count must not"),
        ([Column(tau=0.5), Column(tau=0.6)], "study collapse: point = l/w 0.4 Γ 2.5 with seed 1 is given twice"),
    ],
)
def test_runs_that_must_not_be_mixed_are_refused(tmp_path, undrawn, columns, expected):
    runs = [write_column(tmp_path / str(k), column) for k, column in enumerate(columns)]
    with pytest.raises(InputError) as caught:
        Collapse().analyse(runs, tmp_path / "out", **ORIGIN)
    assert str(caught.value).startswith(expected)


def test_a_run_without_a_free_column_is_missing(tmp_path, undrawn):
    good = write_column(tmp_path / "good", Column(tau=0.5))
    bad = write_column(tmp_path / "bad", Column(tau=0.5, phases=PHASES[:3]))
    Collapse().analyse([good, bad], tmp_path / "out", **ORIGIN)
    missing = pd.read_csv(tmp_path / "out" / "missing.csv", comment="#")
    assert missing["cause"].tolist() == [
        f"{bad}: no shake after a remove-container: its phases are deposit, shake, relax"
    ]
