"""Where does it hold that a blob of worms whose tails let go falls and stays in one piece?

The study `blob-topple` with other values of Young's modulus of a worm, of friction, of the time step and of the
number of segments. A statement is found if it holds at every point.
"""

import pandas as pd

from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import SEED
from postprocess.statistics.seeds import mean_over_seeds
from studies.blob_lift_map import COLUMNS, KEYS, at_each_point, point_name, settings
from studies.blob_topple import AWAY, BEFORE, CLUSTER, FALL, QUANTITIES, SIDE, WHOLE
from studies.blob_topple import measure as measure_fall
from studies.framework.figures import Rows, Series, marker
from studies.framework.findings import Effect, Finding
from studies.framework.runs import Row
from studies.framework.study import Study


def measure(run: Run) -> Row:
    """Measure how a blob fell, and whether it stayed in one piece."""
    return {**settings(run), **measure_fall(run)}


def _falls(table: pd.DataFrame) -> list[Effect]:
    return at_each_point(
        table,
        "height before over height after",
        lambda runs: mean_over_seeds(runs[BEFORE] / (runs[BEFORE] - runs[FALL])),
        threshold=1.0,
    )


def _in_one_piece(table: pd.DataFrame) -> list[Effect]:
    label = "share of worms in one cluster"
    return at_each_point(table, label, lambda runs: mean_over_seeds(runs[CLUSTER]), threshold=WHOLE)


def _sideways(table: pd.DataFrame) -> list[Effect]:
    return at_each_point(
        table, "way sideways over the fall", lambda runs: mean_over_seeds(runs[AWAY] / runs[FALL]), threshold=SIDE
    )


STUDY = Study(
    name="blob-topple-map",
    title="A blob of worms whose tails let go: where the findings hold",
    measure=measure,
    same_fidelity=COLUMNS,
    same_count=(),
    keys=KEYS,
    order=(*COLUMNS, SEED),
    quantities=tuple(QUANTITIES.values()),
    findings=(
        Finding(id="falls", says="The blob falls when its tails let go, at every point", outcome=_falls),
        Finding(id="in-one-piece", says="It stays in one piece, at every point", outcome=_in_one_piece),
        Finding(id="sideways", says="It falls onto its side, at every point", outcome=_sideways),
    ),
    figures=(
        Rows(
            name="map",
            quantities=[QUANTITIES[CLUSTER]],
            row=point_name,
            split=lambda points: [Series(rows=points, label="", properties=marker("o", style.BLACK, style.BLACK))],
        ),
    ),
    remarks=("Worms and phases are those of the study blob-topple with 40 worms, but for what a point's name says.",),
)
