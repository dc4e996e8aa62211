"""Does a tall blob of worms topple in one piece when all tails let go of the surface at once?

Savoie, Tuazon, Tiwari, Bhamla and Goldman, "Amorphous entangled active matter", Soft Matter 2023, show a blob of living
blackworms that stands tall and narrow, held up by tails at the surface of the water. A flash of ultraviolet light makes
all worms retract their tails: the blob falls onto its side and stays entangled (one trial). Here worms are flexible
filaments that tangle in a narrow glass. Then all tails are held and raised a little, the glass is taken away, and all
tails are let go.

The model assumes that worms hold the bends in which they tangled, that tails are held rigidly, and that letting go is
instantaneous. It has no surface of the water, no retraction of tails, no escape from light, and no touch or slime.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.body.bars import segment_distances
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.geometry.segments import close_segments
from postprocess.measures.clusters import joined_clusters
from postprocess.statistics.points import ASPECT, SEED
from postprocess.statistics.seeds import mean_over_seeds
from studies.blob_lift import height_around
from studies.framework.figures import Histories, History, one_by_one
from studies.framework.findings import Effect, Finding, mean
from studies.framework.runs import Key, Row, declare, last_columns, phase_of, run_columns
from studies.framework.study import COUNT, Study

FALL, AWAY, CLUSTER = "fall of the centre of mass [m]", "way sideways [m]", "largest cluster [-]"
SIDEWAYS = "way sideways over the fall [-]"
BEFORE, SLENDER, AFTER = "height before [m]", "slenderness before [-]", "slenderness after [-]"
TOUCHING = 1.05  #: Largest distance of the axes of worms that touch, in diameters
SIDE = 0.5  #: Least horizontal way of the centre of mass, over its fall, if a blob falls onto its side [-]
WHOLE = 0.9  #: Least fraction of the worms in the largest cluster if a blob is in one piece [-]

QUANTITIES = declare(
    {
        BEFORE: ("height [mm]", ".2f", "height of the centre of mass while tails are held and the glass is gone"),
        FALL: ("fall [mm]", ".2f", "by how much the centre of mass is lower at the end"),
        AWAY: ("sideways [mm]", ".2f", "horizontal way of the centre of mass from the release to the end"),
        SIDEWAYS: ("sideways/fall", ".2f", "this way over the fall"),
        SLENDER: ("slender before", ".2f", "spread of all segments along z over that along x and y, tails held"),
        AFTER: ("after", ".2f", "this ratio at the end"),
        CLUSTER: ("one cluster", ".2f", "share of worms in the largest cluster of worms that touch, at the end"),
    },
    scales={BEFORE: 1e3, FALL: 1e3, AWAY: 1e3},
    axes={CLUSTER: "share of worms in one cluster [-]"},
)


def _released(run: Run) -> float:
    """Return the first recorded time after the release of the tails [s]."""
    return float(run.series.time[run.series["phase"] > phase_of(run, "release")][0])


def measure(run: Run) -> Row:
    """Measure how a blob fell, and whether it stayed in one piece."""
    place = phase_of(run, "release")
    held, last = run.frames.in_phase(place - 1)[-1], run.frames[-1]
    one, other = centre(held), centre(last)
    fall, away = one[2] - other[2], float(np.hypot(*(other - one)[:2]))
    return {
        **{name: cell for name, cell in run_columns(run).items() if name != ASPECT},
        BEFORE: one[2] - held.floor_z,
        FALL: fall,
        AWAY: away,
        SIDEWAYS: away / fall,
        SLENDER: slenderness(held),
        AFTER: slenderness(last),
        CLUSTER: largest_cluster(last, run.manifest.sphere_diameter_m),
        **last_columns(run),
    }


def centre(frame: Frame) -> NDArray[np.float64]:
    """Return the common centre of mass (3,) [m] of all bodies of a frame, which have equal masses."""
    return np.asarray(body_centres(frame).mean(axis=0))


def slenderness(frame: Frame) -> float:
    """Return how slender the bodies stand together: vertical over horizontal standard deviation [-].

    The deviations are those of the midpoints of all segments; the horizontal one is the root mean square of those along
    x and y.
    """
    x, y, z = np.var(frame.segments.mean(axis=1), axis=0)
    return float(np.sqrt(2 * z / (x + y)))


def largest_cluster(frame: Frame, diameter: float) -> float:
    """Return the share of all bodies that are in the largest cluster of touching bodies [-].

    Two bodies touch if the distance of their axes is at most `TOUCHING` times their `diameter` [m].
    """
    segments, reach = frame.segments, TOUCHING * diameter
    i, j = close_segments(segments[:, 0], segments[:, 1], frame.body, reach)
    touch = segment_distances(segments[i], segments[j]) <= reach
    return joined_clusters(frame.count, frame.body[i[touch]], frame.body[j[touch]]).largest


def _falls(table: pd.DataFrame) -> list[Effect]:
    return [
        Effect(
            label="height before over height after",
            value=mean_over_seeds(table[BEFORE] / (table[BEFORE] - table[FALL])),
            threshold=1.0,
        ),
        Effect(label="slenderness before less after", value=mean_over_seeds(table[SLENDER] - table[AFTER])),
    ]


def _history(run: Run) -> History:
    return height_around(run, _released(run))


def _path(run: Run) -> History:
    begin = _released(run)
    frames = [frame for frame in run.frames if frame.time >= begin - 1.0]
    centres = np.array([centre(frame) for frame in frames])
    away = np.hypot(*(centres - centres[0])[:, :2].T)
    return History(times=np.array([frame.time - begin for frame in frames]), values=1e3 * away)


STUDY = Study(
    name="blob-topple",
    title="A tall blob of worms whose tails let go",
    measure=measure,
    same_count=(COUNT,),
    keys=(Key(column=COUNT, label="worms", form="g"),),
    order=(COUNT, SEED),
    quantities=tuple(QUANTITIES.values()),
    findings=(
        Finding(id="falls", says="The blob falls when its tails let go, and is less slender then", outcome=_falls),
        mean(
            "sideways",
            "It falls onto its side",
            lambda tallest: tallest[SIDEWAYS],
            "way sideways over the fall, of the tallest blob",
            rows=lambda table: table[table[COUNT] == table[COUNT].max()],
            threshold=SIDE,
        ),
        mean(
            "in-one-piece",
            "It stays in one piece",
            lambda table: table[CLUSTER],
            "share of worms in one cluster",
            threshold=WHOLE,
        ),
    ),
    figures=(
        Histories(
            name="height_time",
            history=_history,
            split=one_by_one(COUNT, "{:g} worms".format),
            x_label="time since tails let go [s]",
            quantities={"": "height of the centre of mass [mm]"},
        ),
        Histories(
            name="sideways_time",
            history=_path,
            split=one_by_one(COUNT, "{:g} worms".format),
            x_label="time since tails let go [s]",
            quantities={"": "way of the centre of mass sideways [mm]"},
            width=0.2,
        ),
    ),
    remarks=(
        "Worms are filaments of 30 × 0.8 mm in water that hold helical bends (250 1/m, wavelength 60 mm). Tails are "
        "the last nodes of all worms; they are held where the tangling left them, and raised by 3 mm.",
    ),
    pictured={"count": 80},
)
