"""Where does it hold that a blob of worms whose tails let go falls and stays in one piece?

The study `blob-topple` with other values of Young's modulus of a worm, of friction, of the time step and of the
number of segments. A statement is found if it holds at every point.
"""

from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import SEED
from studies.blob_lift_map import COLUMNS, KEYS, mean_above, point_name, settings
from studies.blob_topple import BEFORE, CLUSTER, FALL, QUANTITIES, SIDE, SIDEWAYS, WHOLE
from studies.blob_topple import measure as measure_fall
from studies.framework.figures import Rows, Series, marker
from studies.framework.findings import Finding
from studies.framework.runs import Row
from studies.framework.study import Study


def measure(run: Run) -> Row:
    """Measure how a blob fell, and whether it stayed in one piece."""
    return {**settings(run), **measure_fall(run)}


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
        Finding(
            id="falls",
            says="The blob falls when its tails let go, at every point",
            outcome=mean_above(
                lambda table: table[BEFORE] / (table[BEFORE] - table[FALL]), "height before over height after", 1.0
            ),
            found_if="height before over height after > 1 at every point",
        ),
        Finding(
            id="in-one-piece",
            says="It stays in one piece, at every point",
            outcome=mean_above(lambda table: table[CLUSTER], "share of worms in one cluster", WHOLE),
            found_if=f"share of worms in one cluster > {WHOLE:g} at every point",
        ),
        Finding(
            id="sideways",
            says="It falls onto its side, at every point",
            outcome=mean_above(lambda table: table[SIDEWAYS], "way sideways over the fall", SIDE),
            found_if=f"way sideways over the fall > {SIDE:g} at every point",
        ),
    ),
    figures=(
        Rows(
            name="map",
            quantities=[QUANTITIES[SIDEWAYS], QUANTITIES[CLUSTER]],
            row=point_name,
            split=lambda points: [Series(rows=points, label="", properties=marker("o", style.BLACK, style.BLACK))],
            levels={SIDEWAYS: SIDE, CLUSTER: WHOLE},
            notes=("Vertical lines: thresholds of the findings.",),
        ),
    ),
    remarks=("Worms and phases are those of the study blob-topple with 40 worms, but for what a point's name says.",),
)
