"""The study of accuracy: verdicts from made-up numbers, published tables, and an analysis of made-up runs."""

import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun
from synthetic.hooked import weight, write_hooked_run

from postprocess.statistics.points import ASPECT, SEED, marked
from studies.accuracy import (
    ACTIVITY,
    COMPARED,
    COST,
    COUNT,
    EXPECTED,
    GAP,
    RESIDUAL,
    SPHERES,
    TIME_STEP,
    VARIANT,
    WALL,
    Fidelities,
    Rung,
    advise,
    main,
    study,
    work_precision,
    worst_errors,
)
from studies.framework.findings import Outcome
from studies.framework.runs import ENGINE, read_runs

RESULTS = Path(__file__).resolve().parents[2] / "results"
STEPS = [
    Rung(knob="time-step", value="0.9", unit="", setting="base"),
    Rung(knob="time-step", value="0.45", unit="", setting="half"),
    Rung(knob="time-step", value="0.225", unit="", setting="quarter"),
]
RESTITUTIONS = [
    Rung(knob="restitution", value="0.2", unit="", setting="bouncy"),
    Rung(knob="restitution", value="0.7", unit="", setting="base"),
]
COSTS = {"base": 1.0, "half": 2.0, "quarter": 4.0, "bouncy": 3.0}
NARROW = np.array([-0.0005, 0, 0.0005])


def table_of(
    phi_f: Mapping[str, Sequence[float] | np.ndarray],
    rungs: Sequence[Rung] = STEPS,
    *,
    phi_0: Mapping[str, float] | None = None,
) -> pd.DataFrame:
    """The table of runs whose φ_f is given by setting, one value per seed; costs rise by 1 % from seed to seed."""
    rows = [
        {
            **{VARIANT: setting, SEED: seed, ASPECT: 0.7, COUNT: 60, ACTIVITY: "shake", TIME_STEP: 1e-5, SPHERES: 18},
            ENGINE: "yade",
            **{COST: COSTS[setting] * (1 + 0.01 * seed), WALL: 10.0, EXPECTED: 1.0, RESIDUAL: math.nan, GAP: math.nan},
            **{COMPARED["phi_0"]: (phi_0 or {}).get(setting, 0.1) + 1e-3 * seed, COMPARED["phi_f"]: value},
            COMPARED["height"]: 3e-3 + 1e-4 * seed,
            COMPARED["crossings"]: 3.0 + 0.1 * seed,
            COMPARED["energy"]: math.nan,
            COMPARED["hook_force"]: math.nan,
        }
        for setting, values in phi_f.items()
        for seed, value in enumerate(values, start=1)
    ]
    return work_precision(pd.DataFrame(rows), rungs)


def verdicts(table: pd.DataFrame) -> dict[str, str]:
    return dict(zip(table[VARIANT], table["verdict"], strict=True))


def advice(table: pd.DataFrame, knob: str = "time-step") -> tuple[str, str]:
    found: Outcome = advise(table, knob)
    return str(found.verdict), found.note


LINKS = ["shaken", "oscillation", "shape-change"]


@pytest.mark.parametrize(
    "name",
    [
        *("accuracy", "accuracy/reference", "accuracy/oscillation", "accuracy-links/knobs", "accuracy-links/yade"),
        *(f"accuracy-links/{scene}" for scene in LINKS),
    ],
)
def test_published_tables_follow_from_their_runs(name: str) -> None:
    folder = RESULTS / name
    published = pd.read_csv(folder / "work_precision.csv", comment="#", keep_default_na=False, dtype=str)
    rungs = [
        Rung(knob=row["knob"], value=row["value"], unit=row["unit"], setting=row["variant"])
        for _, row in published.iterrows()
    ]
    runs = read_runs(folder).assign(**dict.fromkeys({ENGINE, *COMPARED.values()} - set(read_runs(folder)), math.nan))
    made = work_precision(runs, rungs)
    assert made["verdict"].tolist() == published["verdict"].tolist()
    for column in (one for one in published if "error" in one):
        wanted = pd.to_numeric(published[column]).to_numpy()
        assert made[column].to_numpy() == pytest.approx(wanted, rel=1e-3, abs=1e-3, nan_ok=True), column


def test_the_shipped_table_has_the_rows_of_all_scenes() -> None:
    folder = RESULTS / "accuracy-links"
    header, *rows = (folder / "work_precision.csv").read_text(encoding="utf-8").splitlines()
    parts = [(folder / scene / "work_precision.csv").read_text(encoding="utf-8").splitlines() for scene in LINKS]
    assert [part[0] for part in parts] == [header] * len(parts)
    assert rows == [row for part in parts for row in part[1:]]


def test_errors_and_bands_are_those_put_in() -> None:
    table = table_of({"base": [0.132, 0.133, 0.134], "quarter": [0.120, 0.121, 0.122]}).set_index(VARIANT)
    assert table.loc["base", "phi_f error [%]"] == pytest.approx(100 * (0.133 / 0.121 - 1))
    # Two means of standard error 0.001/√3 each; t(0.975; 4).
    band = 100 / 0.121 * 2.776445 * 0.001 / math.sqrt(3)
    assert table.loc["base", "phi_f error 95 % [%]"] == pytest.approx(band * math.sqrt(2), rel=1e-6)
    assert table.loc["quarter", "phi_f error [%]"] == 0
    assert table.loc["quarter", "phi_f error 95 % [%]"] == pytest.approx(band)
    assert table.loc["base", marked(COMPARED["phi_f"], "SE")] == pytest.approx(0.001 / math.sqrt(3))
    # Three seeds 1 % apart; t(0.975; 2).
    assert table.loc["base", marked(COST, "95 %")] == pytest.approx(0.01 / math.sqrt(3) * 4.302653)
    assert table.loc["half", "seeds [-]"] == 0
    assert math.isnan(table.loc["half", "phi_f error [%]"])


def test_pure_scatter_is_not_resolved() -> None:
    # Null case: every setting has the same distribution. Of many draws at most a few per cent may be resolved in φ_f.
    draw = np.random.default_rng(0)
    resolved = 0
    for _ in range(100):
        values = {name: 0.12 + 0.004 * draw.standard_normal(3) for name in ("base", "half", "quarter")}
        resolved += int(table_of(values)["phi_f resolved"].sum())
    assert 1 <= resolved <= 0.1 * 200
    table = table_of({name: [0.118, 0.120, 0.122] for name in ("base", "half", "quarter")})
    assert verdicts(table) == {"base": "not resolved", "half": "not resolved", "quarter": "reference"}
    verdict, note = advice(table)
    assert verdict == "found"
    assert note.startswith("use 0.9, 4 times as fast as 0.225: ")
    # t(0.975; 6) · 0.002 · √(2/3) / 0.120
    assert note.endswith("are not resolved with 3 seeds, and 3.3 % in φ cannot be excluded")


def test_the_cheapest_unresolved_rung_is_named_and_a_finer_resolved_one_with_it() -> None:
    table = table_of({"base": 0.126 + NARROW, "half": 0.120 + NARROW, "quarter": 0.120 + NARROW})
    assert advice(table)[1].startswith("use 0.45, ")
    odd = table_of({"base": 0.120 + NARROW, "half": 0.126 + NARROW, "quarter": 0.120 + NARROW})
    assert advice(odd)[1].startswith("use 0.9, ")
    assert advice(odd)[1].endswith("but errors of a finer rung are resolved: 0.45")


def test_the_finest_rung_with_runs_stands_in_for_one_without() -> None:
    table = table_of({"base": 0.126 + NARROW, "half": 0.120 + NARROW, "quarter": [0.1]})
    assert set(table["reference"]) == {"half"}
    assert verdicts(table) == {"base": "resolved", "half": "reference", "quarter": "resolved"}


def test_a_sensitivity_is_compared_with_the_scene_itself_and_recommends_nothing() -> None:
    table = table_of({"base": 0.120 + NARROW, "bouncy": 0.132 + NARROW}, RESTITUTIONS)
    assert verdicts(table) == {"bouncy": "resolved", "base": "reference"}
    verdict, note = advice(table, "restitution")
    assert verdict == "found"
    assert "against 0.7 resolved: 0.2 (" in note
    # No finer rung stands in for the scene itself.
    missing = table_of({"bouncy": 0.132 + NARROW}, RESTITUTIONS)
    assert set(missing["verdict"]) == {"unknown"}


# Whole analyses

ORIGIN = {"note": "knobs time-step of scene.yaml", "command": "smarticles accuracy scene.yaml --out 'my ladder'"}


def run(**changes: Any) -> SyntheticRun:
    keys: dict[str, Any] = {"phases": ("deposit", "relax", "shake", "relax"), "shake_time": 2.0, "frames_per_phase": 2}
    return SyntheticRun(**{**keys, **changes})


def test_scenes_with_a_hook_are_compared_by_its_peak_force_too(tmp_path: Path) -> None:
    # In units of the weight of one smarticle: constant forces, so that the peak is known.
    phases = ("deposit", "relax", "shake", "pull-hook")
    directories = []
    for setting, load in {"base": 3.0, "quarter": 2.0}.items():
        for seed in (1, 2):
            made = run(phases=phases, seed=seed, packing=(0.1,) * 4)
            force = weight(made) * (load + 0.1 * seed)
            directory = tmp_path / f"{setting}_seed{seed}"
            directories.append(write_hooked_run(directory, made, lambda time, force=force: np.full_like(time, force)))
    report = study(STEPS).analyse(directories, tmp_path / "out", **ORIGIN)
    table = report.tables["work_precision"].set_index(VARIANT)
    assert table.loc["base", COMPARED["hook_force"]] == pytest.approx(3.15 / run().count)
    assert table.loc["base", "hook_force error [%]"] == pytest.approx(100 * (3.15 / 2.15 - 1))
    assert table.loc["base", "hook_force resolved"]


ON_LINKS = RESULTS / "accuracy-links"


def ladder_of_fidelities() -> pd.DataFrame:
    return pd.read_csv(ON_LINKS / "shaken" / "work_precision.csv", comment="#")


def test_an_error_without_a_band_is_not_the_largest() -> None:
    table = ladder_of_fidelities()
    known = worst_errors(table)
    assert known["quantity"].tolist()[0] == "⟨N⟩"
    table["phi_0 error 95 % [%]"] = math.nan
    found = worst_errors(table)
    assert np.isfinite(found[["error [%]", "bound [%]"]].to_numpy()).all()
    assert found["quantity"].tolist()[0] == "⟨N⟩"


@pytest.mark.parametrize("cost", [0.0, math.nan])
def test_fidelities_without_a_cost_are_drawn_nowhere(cost: float, tmp_path: Path) -> None:
    table = ladder_of_fidelities()
    table.loc[0, COST] = cost
    assert Fidelities().compare(tmp_path / "one", {"shaken": table}, ["A footer."])
    table[COST] = cost
    assert Fidelities().compare(tmp_path / "all", {"shaken": table}, ["A footer."])


def test_the_figure_of_several_ladders_is_drawn_from_their_tables(tmp_path: Path) -> None:
    for name in ("shaken", "oscillation"):
        (tmp_path / name).mkdir()
        shutil.copy(ON_LINKS / name / "work_precision.csv", tmp_path / name)
    main([str(tmp_path), "shaken", "oscillation"])
    assert (tmp_path / "fidelities.png").is_file()
    with pytest.raises(SystemExit):
        main([str(tmp_path), "absent"])
