"""Read the rigid boundaries of a run and where they are at a time: wall, mould, hooks, strings."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from dem.record.frame import Frame
from dem.record.run import Run, SceneData
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.mould import read_tiers

_REMOVAL, _STRAIN, _ARRANGE = "remove-container", "strain", "arrange"

Bounds = tuple[float, float, float, float, float, float]
"""Least and largest x, y and z of a box [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnHooks:
    """Two crosses of square bars.

    Attributes:
        bars: Of the lower and of the upper cross, about the cross's centre.
        lower: Height of the lower cross above the floor [m].
        times: (n,) at which the upper cross's height is known [s].
        upper: (n,) height of the upper cross above the floor [m].
    """

    bars: tuple[tuple[Bounds, ...], tuple[Bounds, ...]]
    lower: float
    times: Floats = field(repr=False)
    upper: Floats = field(repr=False)

    def heights(self, time: float) -> tuple[float, float]:
        """Return the heights of the lower and the upper cross above the floor at a time [m]."""
        return self.lower, float(np.interp(time, self.times, self.upper))


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainStrings:
    """Strings of a strain test; lengths in m.

    Attributes:
        phase: Index of the phase while they are tied.
        start: Time at which that phase begins [s].
        speed: Of the end that is moved [m/s].
        from_hinge: Where on a barb they are tied, from its hinge [m].
        anchors: (2, 3) the other ends at the start: at lower x, held, and at higher x, moved away along x.
    """

    phase: int
    start: float
    speed: float
    from_hinge: float
    anchors: Floats = field(repr=False)

    def lines(self, frame: Frame) -> Floats:
        """Return knot and other end (2, 2, 3) of each string [m]; (0, 2, 3) while none is tied."""
        if frame.phase != self.phase:
            return np.empty((0, 2, 3))
        ends = self.anchors.copy()
        ends[1, 0] += self.speed * (frame.time - self.start)
        return np.stack([knots(frame.vertices, self.from_hinge), ends], axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surroundings:
    """The rigid boundaries of a run.

    Attributes:
        tiers: Radius and top of each tier of a mould, from the bottom up [m]; empty for one cylinder.
        height: Of the cylinder's wall [m]; None: as high as the pile needs.
        floor_alone: Indices of phases that move the floor and leave the wall at rest, at z = 0.
        removed: Index of the phase that takes the wall away; None if none does.
        lift: Start [s], end [s] and speed [m/s] of its lifting; None if it goes at once.
        hooks: None in scenes without.
        strings: Of a strain test; None in scenes without.
    """

    tiers: tuple[tuple[float, float], ...] = ()
    height: float | None = None
    floor_alone: frozenset[int] = frozenset()
    removed: int | None = None
    lift: tuple[float, float, float] | None = None
    hooks: DrawnHooks | None = field(default=None, repr=False)
    strings: ChainStrings | None = field(default=None, repr=False)

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Radius and height of the corners of a mould's wall, from the floor up [m]: walls and ceilings in turn."""
        found = [(self.tiers[0][0], 0.0), self.tiers[0]] if self.tiers else []
        for (_, top), (radius, higher) in pairwise(self.tiers):
            found += [(radius, top), (radius, higher)]
        return found

    def raised(self, time: float, phase: int, top: float) -> float | None:
        """Return how far the wall has been lifted [m] at a time [s] in a phase; None once it is gone.

        A wall that is lifted clear of the pile's top, at a height above the floor [m], is gone.
        """
        if self.removed is None or phase < self.removed:
            return 0.0
        if self.lift is None:
            return None
        start, end, speed = self.lift
        raised = speed * (min(max(time, start), end) - start)
        return raised if raised <= top else None


def read_surroundings(run: Run) -> Surroundings:
    """Read the rigid boundaries of a run from its scene and its series.

    Raises:
        InputError: `scene.yaml` or `series.h5` is damaged, or lacks what it should have.
    """
    scene, phases = run.scene, run.scene.get("phases", ())
    series = run.series if run.has_series else None
    hooks = scene.get("hooks")
    removed = next((phase.index for phase in run.phases if phase.type == _REMOVAL), None)
    return Surroundings(
        tiers=tuple((tier.radius, tier.top) for tier in read_tiers(run)),
        height=(scene.get("container") or {}).get("height_m"),
        floor_alone=frozenset(index for index, phase in enumerate(phases) if phase.get("moves") == "floor"),
        removed=removed,
        lift=None if removed is None else _lift(phases[removed], _start(run, removed, series)),
        hooks=None if hooks is None else _hooks(hooks, series),
        strings=_strings(run, series) if run.manifest.planar else None,
    )


def _start(run: Run, index: int, series: Series | None) -> float | None:
    """Return when a phase begins [s]; a phase that is not done began with the last sample of the one before."""
    start = run.phases[index].start_s
    if start is None and series is not None:
        start = float(series.time[series["phase"] < index].max(initial=0.0))
    return start


def _lift(phase: SceneData, start: float | None) -> tuple[float, float, float] | None:
    if phase.get("speed_m_per_s") is None or start is None:
        return None
    return start, start + phase["duration_s"], phase["speed_m_per_s"]


def _hooks(settings: SceneData, series: Series | None) -> DrawnHooks:
    """Return the hooks of a scene; without a series the upper one is where it started."""
    times, upper = np.zeros(1), np.array([settings["upper_height_m"]])
    if series is not None:
        times, upper = series.time, series["hook_upper_z_m"] - series["container_z_m"]
    side, length = settings["side_m"], settings["length_m"]
    # Older scenes have two equal crosses.
    lower_length, count = settings.get("lower_length_m", length), round(settings.get("lower_bars", 1))
    return DrawnHooks(
        bars=(_bars(lower_length, side, count), _bars(length, side, 1)),
        lower=settings["lower_height_m"],
        times=times,
        upper=upper,
    )


def _bars(length: float, side: float, count: int) -> tuple[Bounds, ...]:
    """Return bars evenly spaced along x and y, up to a disc, as `dem.setting.hooks.Cross` has them."""
    thick, found = side / 2, []
    for k in range(count):
        place = length * ((k + 1) / (count + 1) - 0.5)
        long = math.sqrt((length / 2) ** 2 - place**2)
        found.append((-long, long, place - thick, place + thick, -thick, thick))
        found.append((place - thick, place + thick, -long, long, -thick, thick))
    return tuple(found)


def knots(vertices: Floats, from_hinge: float) -> Floats:
    """Return points (2, 3) on the outer barbs of a chain, at a distance [m] from their hinges.

    Every second smarticle is turned by half a turn.

    Source:
        `dem.body.chain.Chain.ties`.
    """
    last = len(vertices) - 1
    points = []
    for smarticle, tip, hinge in ((0, 0, 1), (last, 0, 1) if last % 2 else (last, 3, 2)):
        along = vertices[smarticle, tip] - vertices[smarticle, hinge]
        points.append(vertices[smarticle, hinge] + from_hinge * along / np.linalg.norm(along))
    return np.array(points)


def _strings(run: Run, series: Series | None) -> ChainStrings | None:
    """Return the strings of a run's strain test; None where there is no such phase.

    They are tied to the chain as it was laid out; a chain that moved before it was pulled has them where they are to
    within that motion.

    Source:
        `dem.body.chain.Chain`: how a chain is laid out.
    """
    planned = run.scene["phases"]
    phases = {phase["type"]: phase for phase in planned}
    if _STRAIN not in phases or _ARRANGE not in phases:
        return None
    strain, gap = phases[_STRAIN], phases[_ARRANGE]["gap_m"]
    index = planned.index(strain)
    radius, barb = run.manifest.sphere_diameter_m / 2, run.manifest.barb_length_m
    offset = barb + gap + run.manifest.bulge_m + radius  # of the two rows of middle links
    from_hinge = barb - radius if strain.get("tied_at") == "tip" else offset / 2
    reach = (
        (run.manifest.count - 1) * (run.manifest.middle_length_m - 2 * radius - gap) + run.manifest.middle_length_m
    ) / 2
    length = strain["string_length_m"]
    ends = reach + np.sqrt(length**2 - (from_hinge - offset / 2) ** 2)
    return ChainStrings(
        phase=index,
        start=_start(run, index, series) or 0.0,
        speed=strain["speed_m_per_s"],
        from_hinge=from_hinge,
        anchors=np.array([[-ends, 0.0, 0.0], [ends, 0.0, 0.0]]),
    )
