"""A cell of each table of the reproduction, run anew: is what stands in results/ what this version finds?

Of the scene of one run, the very one by its hash, everything that is measured must lie where a further seed of its cell
would: within the scatter of the cell's other seeds. On a processor of the kind that the table was made on, it is the
number itself; on another one the last bits differ, and a pile with them. The cheapest cells run by default, all of them
with `pytest -m "long or not long" tests/links/test_cells_of_results.py`.
"""

import math
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pandas as pd
import pytest
from scipy import stats

from dem.record.run import open_run
from dem.scene.reading import dump_scene
from dem.scene.scene import Scene
from studies.framework.runs import DEFINITION
from studies.framework.study import Study
from studies.registry import shipped
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import SEED, load_sweep

RESULTS = Path(__file__).resolve().parents[2] / "results"
CHANCE = 0.01
"""That a sound run is found out of its cell, all its columns together."""

NUMBERED = (SEED, "block")
"""Variables that tell runs of one point apart: `finite-size` has several blocks of its seeds."""

DIGITS = 1e-5  # tables have six
MACHINE = ("processor", "wall time")
"""What columns of the machine's time begin with: they say nothing of the pile."""

CELLS = [
    ("engines", "hook_links_seed2"),
    ("chain", "baseline_n2_hH0.520_seed1"),
    ("finite-size", "lw0.09_n100_seed1"),
    ("shaft", "shape-change_lw1.00_k3.0_seed1"),
    pytest.param("chain-bodies", "baseline_n2_hH0.520_seed1", marks=pytest.mark.engine),
    *(
        pytest.param(*cell, marks=pytest.mark.long)
        for cell in (
            ("procedures-main", "shape-change_lw1.00_links_seed1"),
            ("procedures-main-rigid", "shape-change_lw1.00_links_seed1"),
            ("procedures", "shape-change_lw1.10_links_seed1"),
            ("procedures-code", "shape-change_lw1.10_links_seed1"),
            ("factors", "text_halt_mu0.4_lw1.00_seed1"),
            ("melting", "static_lw0.70_links_seed1"),
            ("melting-code", "static_lw0.70_links_seed1"),
            ("casting", "static_links_seed1"),
            ("casting-code", "static_links_seed1"),
            ("fracture", "static_lw0.70_links_seed1"),
            ("fracture-code", "static_lw0.70_links_seed1"),
            ("strength", "static_h13_lw0.70_links_seed1"),
            ("strength-code", "static_h13_lw0.70_links_seed1"),
            ("friction", "lw1.00_mu0.20_seed1"),
            ("landscape", "internal20_0.25s_lw1.10_seed1"),
            ("gravish", "lw1.10_links_seed1"),
            ("collapse", "lw1.17_gamma4.0_seed1"),
            ("contacts", "lw1.00_mu0.40_wall0.80_e0.7_seed1"),
        )
    ),
]
OTHERS = [
    ("procedures", "shape-change_lw1.10_links_seed1", "internal10_lw1.10_links_seed1"),
    ("strength-code", "static_h13_lw0.70_links_seed1", "shape-change_h13_lw0.70_links_seed2"),
    ("finite-size", "lw0.09_n100_seed1", "lw0.13_n100_seed1"),
    ("collapse", "lw1.17_gamma4.0_seed1", "lw0.66_gamma4.0_seed1"),
]
FEWEST = {"compaction": 4, "finite-size": 6, "landscape": 3}
"""Seeds of a cell where there are fewer than eight: the fewer, the wider is where a further one would lie."""


@dataclass(frozen=True)
class Cell:
    """What a table says of the seeds of one point.

    Attributes:
        table: The study's folder under results/.
        run: Name of one run.
        rows: Numbers of all seeds of its point, by run.
    """

    table: str
    run: str
    rows: pd.DataFrame

    def outside(self, row: Mapping[str, object]) -> dict[str, str]:
        """The columns in which a row does not belong here, and how."""
        columns = [name for name in self.rows if not str(name).startswith(MACHINE)]
        found = {}
        for name in columns:
            others, value = self.rows[name].dropna(), float(str(row.get(name, math.nan)))
            if len(others) < 3 or math.isnan(value):
                continue
            width = stats.t.ppf(1 - CHANCE / len(columns) / 2, len(others) - 1) * others.std()
            width = width * math.sqrt(1 + 1 / len(others)) + DIGITS * abs(others.mean())
            if abs(value - others.mean()) > width:
                found[str(name)] = f"{value:g}, where the others are {others.mean():g} ± {width:g}"
        return found


@cache
def points(table: str) -> dict[str, Point]:
    return {point.name: point for point in expand(load_sweep(shipped(table).sweep_file()))}


@cache
def runs(table: str) -> pd.DataFrame:
    """The table of runs; where one is measured in several ways, as columns that collapse are, the first of them."""
    rows = pd.read_csv(RESULTS / table / "runs.csv", comment="#").set_index("run")
    return rows[~rows.index.duplicated()]


def cell(table: str, run: str) -> Cell:
    rows = runs(table)
    alike = {name: value for name, value in points(table)[run].values.items() if name not in NUMBERED}
    seeds = [
        name
        for name, point in points(table).items()
        if name in rows.index and {key: point.values[key] for key in alike} == alike
    ]
    numbers = rows.loc[seeds].select_dtypes("number").drop(columns=[SEED])
    return Cell(table=table, run=run, rows=numbers)


def again(table: str, run: str, scene: Scene, folder: Path) -> Mapping[str, object]:
    """What the study measures of a scene that is run now."""
    file, out = folder / f"{run}.yaml", folder / "runs" / run
    file.write_text(dump_scene(scene), encoding="utf-8")
    command = [sys.executable, "-m", "smarticles", "run", str(file), "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    study = shipped(table).load()
    measured = study.measured if isinstance(study, Study) else study.measure
    return measured(open_run(out)).rows[0]


@pytest.mark.parametrize(("table", "run"), CELLS)
def test_a_cell_comes_out_again(table: str, run: str, tmp_path: Path) -> None:
    point = points(table)[run]
    told = runs(table).loc[run]
    assert told["scene_sha256"] == point.scene_sha256, "the table is of another scene than the study has now"
    measured = again(table, run, point.scene, tmp_path)
    known = cell(table, run)
    assert len(known.rows) >= FEWEST.get(table, 8)
    assert set(known.rows) - {"engine"} <= set(measured)
    assert known.outside(measured) == {}


@pytest.mark.long
def test_a_long_run_begins_as_the_table_has_it(tmp_path: Path) -> None:
    """Two hundred seconds of shaking are minutes; their first five are not."""
    table, run, begin = "compaction", "lw0.70_mu0.65_seed1", 5.0
    point = points(table)[run]
    assert runs(table).loc[run]["scene_sha256"] == point.scene_sha256
    phases = [
        phase.model_copy(update={"duration_s": begin}) if phase.type == "shake" else phase
        for phase in point.scene.phases
    ]
    assert phases != list(point.scene.phases)
    measured = again(table, run, point.scene.model_copy(update={"phases": tuple(phases)}), tmp_path)
    known = cell(table, run)
    columns = [f"phi_0 {DEFINITION} [-]", "crossings before [-]", f"phi {begin:g} s {DEFINITION} [-]"]
    part = Cell(table=table, run=run, rows=known.rows[columns])
    assert len(part.rows) >= FEWEST[table]
    assert part.outside(measured) == {}
    assert part.outside(runs("friction").loc["lw0.40_mu0.65_seed1"].to_dict())


@pytest.mark.parametrize(("table", "run", "other"), OTHERS)
def test_a_run_of_another_cell_is_found_out(table: str, run: str, other: str) -> None:
    stranger = cell(table, other).rows.loc[other]
    assert cell(table, run).outside(stranger.to_dict())
    assert cell(table, run).outside(cell(table, run).rows.loc[run].to_dict()) == {}
