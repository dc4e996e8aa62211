"""Where does it hold that a quiet blob of worms is lifted as a whole, and an active one left behind?

The study `blob-lift` with other values of the two parameters that are known least, Young's modulus of a worm and
friction, and of two numerical ones, the time step and the number of segments. A statement is found if it holds at every
point.
"""

from collections.abc import Callable

import pandas as pd

from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import SEED, paired_differences
from postprocess.statistics.seeds import mean_over_seeds
from studies.blob_lift import ACTIVE, LEFT, OTHERS, QUANTITIES, RISE, SHARE, WHOLE
from studies.blob_lift import measure as measure_lift
from studies.framework.figures import Rows, Series, marker
from studies.framework.findings import Effect, Finding, Outcome, Verdict, all_of, symbol, unit_of
from studies.framework.runs import Key, Row
from studies.framework.study import Study

MODULUS, FRICTION = "Young's modulus [Pa]", "friction [-]"
SEGMENTS, STEP = "segments of a worm [-]", "time step over the stable one [-]"
KEYS = (
    Key(column=MODULUS, label="E", form="g", unit=" kPa", scale=1e-3),
    Key(column=FRICTION, label="μ", form="g"),
    Key(column=SEGMENTS, label="segments", form="g"),
    Key(column=STEP, label="step", form="g"),
)
COLUMNS = tuple(key.column for key in KEYS)


def settings(run: Run) -> Row:
    """Return what varies from point to point: modulus, friction, number of segments and time step of a run."""
    scene = run.scene
    return {
        MODULUS: float(scene["particle"][0]["young_modulus_Pa"]),
        FRICTION: float(scene["contact"]["friction_smarticle"]),
        SEGMENTS: int(scene["particle"][0]["segments"]),
        STEP: float(scene["fidelity"]["time_step_fraction"]),
    }


def point_name(row: pd.Series) -> str:
    """Return the name of a point, such as `E 50 kPa, μ 0.3`; numerical parameters only where they are not the usual."""
    usual = {SEGMENTS: 12, STEP: 0.92}
    shown = (key for key in KEYS if row[key.column] != usual.get(key.column))
    return ", ".join(f"{key.label} {key.text(row[key.column])}" for key in shown)


def at_each_point(table: pd.DataFrame, effect: Callable[[pd.DataFrame], Effect]) -> Outcome:
    """Judge an effect at each point; the outcome names the points by their verdict, and the weakest effect."""
    runs = {name: rows for name, rows in table.groupby(table.apply(point_name, axis=1), sort=False)}
    effects = {name: effect(rows) for name, rows in runs.items()}
    parts = []
    for verdict in Verdict:
        names = [str(name) for name, one in effects.items() if one.verdict == verdict]
        if names:
            where = "" if len(names) == len(effects) else f" ({'; '.join(names)})"
            parts.append(f"{verdict} at {len(names)} of {len(effects)} points{where}")
    if effects:
        name, least = min(effects.items(), key=lambda one: one[1].value.value)
        parts.append(f"least at {name}: {least}")
    return Outcome(note="; ".join(parts), verdict=all_of(one.verdict for one in effects.values()))


def quiet_above_active(column: str) -> Callable[[pd.DataFrame], Outcome]:
    """Return the outcome of comparing the quiet with the active blob, pair by pair of a seed, at each point."""

    def effect(runs: pd.DataFrame) -> Effect:
        ends = runs[ACTIVE].max(), runs[ACTIVE].min()
        value = mean_over_seeds(paired_differences(runs, column, ACTIVE, ends, [SEED])[column])
        label = f"{symbol(column)} of the quiet blob less that of the active one"
        return Effect(label=label, value=value, unit=unit_of(column))

    return lambda table: at_each_point(table, effect)


def mean_above(values: Callable[[pd.DataFrame], pd.Series], label: str, threshold: float) -> Callable[..., Outcome]:
    """Return the outcome of comparing the mean of a value with a threshold at each point."""
    return lambda table: at_each_point(
        table, lambda runs: Effect(label=label, value=mean_over_seeds(values(runs)), threshold=threshold)
    )


def _by_activity(points: pd.DataFrame) -> list[Series]:
    looks = ((0.0, "quiet, 0 Hz", style.BLUE), (2.0, "active, 2 Hz", style.ORANGE))
    return [
        Series(rows=points[points[ACTIVE] == hertz], label=label, properties=marker("o", colour, colour))
        for hertz, label, colour in looks
    ]


def measure(run: Run) -> Row:
    """Measure how far a blob rose, and how many worms came along."""
    return {**settings(run), **measure_lift(run)}


STUDY = Study(
    name="blob-lift-map",
    title="A blob of worms on a stick: where the findings hold",
    measure=measure,
    same_count=(),
    same_fidelity=COLUMNS,
    keys=(*KEYS, Key(column=ACTIVE, label="active", form="g", unit=" Hz")),
    order=(*COLUMNS, ACTIVE, SEED),
    quantities=tuple(QUANTITIES.values()),
    findings=(
        Finding(
            id="as-a-whole",
            says="A quiet blob is entangled tightly enough to be lifted as a whole, at every point",
            outcome=mean_above(lambda quiet: quiet[SHARE], "share of worms of the quiet blob that are lifted", WHOLE),
            found_if=f"share of worms of the quiet blob that are lifted > {WHOLE:g} at every point",
            rows=lambda table: table[table[ACTIVE] == 0],
        ),
        Finding(
            id="quiet-above-active",
            says="A quiet blob is lifted farther than an active one, at every point",
            outcome=quiet_above_active(RISE),
            found_if="rise of the quiet blob less that of the active one > 0 at every point",
        ),
        Finding(
            id="more-come-along",
            says="More of the worms that are not gripped come along with a quiet blob, at every point",
            outcome=quiet_above_active(OTHERS),
            found_if="share lifted of those not gripped, quiet less active > 0 at every point",
        ),
    ),
    figures=(
        Rows(
            name="map",
            quantities=[QUANTITIES[SHARE], QUANTITIES[OTHERS]],
            row=point_name,
            split=_by_activity,
            levels={SHARE: WHOLE, OTHERS: LEFT},
            notes=("Vertical lines: thresholds of the findings.",),
        ),
    ),
    remarks=("Worms and phases are those of the study blob-lift, but for what a point's name says.",),
)
