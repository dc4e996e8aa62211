"""Do worms tangle if they seldom reverse their turns, and untangle if they often do?

Patil et al., Science 380, 392 (2023), observe that blackworms tangle in minutes and untangle in milliseconds. In their
model each worm's head turns in loops at a rate α, and reverses the sense of its turns at random times with a rate λ:
many loops between reversals (γ = α/2πλ) tangle the worms, few loops untangle them. Here worms are flexible filaments
whose preferred curvature turns about their axis and reverses at random times.

The model assumes the same γ of all worms, and turns of helical bends in place of a head that leads the body. A free
filament makes these turns by rolling about its axis; in the variant `loops` a drag against rolling makes it loop in
space instead. It has no sense of touch and no escape. A dish holds the blob together, so that crossing numbers also
say how dense it is; the share of worms that come along with an end piece, as in the study `blob-lift`, says how well
they hold.
"""

import math
from collections.abc import Callable

import numpy as np
import pandas as pd

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.measures.crossing_number import average_crossing_numbers
from postprocess.report import figures as style
from postprocess.statistics.points import SEED
from studies.blob_lift import CROSSINGS, OTHERS, QUANTITIES, SHARE
from studies.blob_lift import measure as measure_lift
from studies.framework.figures import Histories, History, Means, Series, marker, one_by_one
from studies.framework.findings import Finding, mean, slope
from studies.framework.provenance import Reference
from studies.framework.runs import Key, Quantity, Row, phase_of
from studies.framework.study import Study

STAGE, TANGLING, UNTANGLING = "stage", "tangling", "untangling"
TURNS, DECADES = "turns between reversals [-]", "log10 of turns between reversals [-]"
GAIN = "crossing number gained [-]"
OFTEN = 0.1  #: γ of frequent reversals


def _stages(run: Run) -> tuple[int, str, float]:
    """Return the index of the phase in which worms tangle, the stage that a run is about, and γ in this stage."""
    place = phase_of(run, "lift") - 2
    stage = UNTANGLING if run.scene["phases"][place + 1]["frequency_hz"] else TANGLING
    acts = run.scene["phases"][place + (stage == UNTANGLING)]
    return place, stage, float(acts["turns_between_reversals"])


def measure(run: Run) -> Row:
    """Measure how far a blob rose, how many worms came along, and how crossings changed in the stage of the run."""
    place, stage, turns = _stages(run)
    gained = _crossings(run.frames.in_phase(place + 1)[-1]) - _crossings(run.frames.in_phase(place)[-1])
    return {**measure_lift(run), STAGE: stage, TURNS: turns, DECADES: math.log10(turns), GAIN: gained}


def _crossings(frame: Frame) -> float:
    """Return the mean average crossing number of a worm with all others [-]."""
    return average_crossing_numbers(frame.segments, frame.body).mean


def _history(run: Run) -> History:
    """Read the mean average crossing number of a worm from the beginning of tangling to the lift."""
    place, _, _ = _stages(run)
    frames = [*run.frames.in_phase(place), *run.frames.in_phase(place + 1)]
    begin = float(run.series.time[run.series["phase"] == place][0])
    return History(
        times=np.array([frame.time - begin for frame in frames]),
        values=np.array([_crossings(frame) for frame in frames]),
    )


def _in(stage: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table[table[STAGE] == stage]


def _rises(name: str, says: str, quantity: str, stage: str) -> Finding:
    return slope(name, says, quantity, DECADES, rows=_in(stage))


def _crossings_over_time(stage: str, note: str) -> Histories:
    return Histories(
        name=f"{stage}_time",
        history=_history,
        rows=_in(stage),
        split=one_by_one(TURNS, "γ = {:g}".format),
        x_label="time since tangling began [s]",
        quantities={"": "crossing number of a worm with all others [-]"},
        width=0.2,
        marks=(6.0,),
        notes=(note,),
    )


def _by_stage(points: pd.DataFrame) -> list[Series]:
    looks = ((TANGLING, "slow turns tangle, lifted at rest", style.BLUE), (UNTANGLING, "then fast turns", style.ORANGE))
    return [
        Series(rows=_in(stage)(points), label=label, properties=marker("o", colour, colour))
        for stage, label, colour in looks
    ]


STUDY = Study(
    name="blob-tangle",
    title="Blobs of worms that reverse their turns seldom or often",
    measure=measure,
    same_count=(),
    keys=(Key(column=STAGE, label="stage", order=(TANGLING, UNTANGLING)), Key(column=TURNS, label="γ", form="g")),
    order=(STAGE, TURNS, SEED),
    quantities=(
        *QUANTITIES.values(),
        Quantity(
            column=GAIN,
            label="⟨ACN⟩ gained",
            form="+.2f",
            meaning="crossing number before the lift less that at the end of the slow turns",
        ),
    ),
    findings=(
        _rises(
            "tangles", "The more rarely worms reverse slow turns, the more of them then come along", OTHERS, TANGLING
        ),
        _rises(
            "crosses", "The more rarely worms reverse slow turns, the more they cross each other", CROSSINGS, TANGLING
        ),
        _rises(
            "untangles", "The more often tangled worms reverse fast turns, the fewer come along", OTHERS, UNTANGLING
        ),
        mean(
            "uncrosses",
            "Tangled worms that often reverse fast turns lose crossings",
            lambda often: often[GAIN],
            f"crossing number gained in 2 s of fast turns with γ = {OFTEN:g}",
            rows=lambda table: table[(table[STAGE] == UNTANGLING) & (table[TURNS] == OFTEN)],
            sign=-1,
        ),
    ),
    figures=(
        Means(
            name="lifted_turns",
            quantities=[QUANTITIES[SHARE], QUANTITIES[OTHERS]],
            x=TURNS,
            x_label="turns between reversals γ [-]",
            log_x=True,
            split=_by_stage,
        ),
        _crossings_over_time(TANGLING, "Worms turn slowly up to the broken line, then hold their bends."),
        _crossings_over_time(UNTANGLING, "Worms turn slowly, with γ = 1, up to the broken line, then fast."),
    ),
    remarks=(
        "Worms are filaments of 30 × 0.8 mm in water that bend into helices (250 1/m, wavelength 60 mm); these turn at "
        "0.5 Hz while worms tangle, and at 2 Hz while they untangle.",
    ),
    pictured={"tangle_turns": 3},
    reference=Reference(
        statement="abstract of Patil et al., Science 2023, DOI 10.1126/science.ade7759, and its summary in Physics "
        "Today, DOI 10.1063/PT.3.5261; no data of theirs",
        facts={"doi": "10.1126/science.ade7759", "what": "statements in the abstract, and in 10.1063/PT.3.5261"},
    ),
)
