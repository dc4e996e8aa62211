"""What does not give way to smarticles, for pictures: hooks, walls and strings, where they are at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Self

import numpy as np

from dem.record.run import Run, SceneData
from dem.record.series import Series
from postprocess.measures.mould import read_tiers
from postprocess.pictures.strings import ChainStrings, read_strings

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REMOVAL = "remove-container"


Bounds = tuple[float, float, float, float, float, float]
"""Least and largest x, y and z of a box [m]."""


def _bars(length: float, side: float, count: int) -> tuple[Bounds, ...]:
    """As `dem.setting.hooks.Cross` has them: evenly spaced along x and y, up to a disc."""
    thick, found = side / 2, []
    for k in range(count):
        place = length * ((k + 1) / (count + 1) - 0.5)
        long = math.sqrt((length / 2) ** 2 - place**2)
        found.append((-long, long, place - thick, place + thick, -thick, thick))
        found.append((place - thick, place + thick, -long, long, -thick, thick))
    return tuple(found)


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnHooks:
    """Two crosses of two square bars each.

    Attributes:
        side: Of the bars [m].
        length: Of the bars [m].
        lower_length: Of those of the lower cross, or the diameter of a grid of several [m].
        lower_bars: Bars of the lower cross along x, and as many along y.
        lower: Height of the lower cross above the floor [m].
        times: (n,) at which the upper cross's height is known [s].
        upper: (n,) height of the upper cross above the floor [m].
    """

    side: float
    length: float
    lower_length: float
    lower_bars: int
    lower: float
    times: NDArray[np.float64] = field(repr=False)
    upper: NDArray[np.float64] = field(repr=False)

    @classmethod
    def of(cls, settings: SceneData, series: Series | None) -> Self:
        """Hooks of a scene; without a series the upper one is drawn where it started."""
        times, upper = np.zeros(1), np.array([settings["upper_height_m"]])
        if series is not None:
            times, upper = series.time, series["hook_upper_z_m"] - series["container_z_m"]
        return cls(
            side=settings["side_m"],
            length=settings["length_m"],
            # Older scenes have two crosses alike, and do not say so.
            lower_length=settings["lower_length_m" if "lower_length_m" in settings else "length_m"],
            lower_bars=round(settings["lower_bars"]) if "lower_bars" in settings else 1,
            lower=settings["lower_height_m"],
            times=times,
            upper=upper,
        )

    @property
    def bars(self) -> tuple[tuple[Bounds, ...], tuple[Bounds, ...]]:
        """Bars of the lower and of the upper hook, as their corners about the hook's centre."""
        return _bars(self.lower_length, self.side, self.lower_bars), _bars(self.length, self.side, 1)

    def heights(self, time: float) -> tuple[float, float]:
        """Heights of the lower and the upper cross above the floor at a time [m]."""
        return self.lower, float(np.interp(time, self.times, self.upper))


@dataclass(frozen=True, kw_only=True)
class Lift:
    """A wall that is lifted.

    Attributes:
        start: Time at which it begins to rise [s].
        end: Time at which it stops, if it was not clear of the pile before [s].
        speed: [m/s].
    """

    start: float
    end: float
    speed: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Surroundings:
    """The container and the hooks of a run.

    Attributes:
        tiers: Radius and top of each tier of a mould, from the bottom up [m]; empty for one cylinder, which is drawn
            as high as the pile needs.
        removed: Index of the phase that takes the wall away; None if none does.
        lift: How it is lifted; None if it goes at once.
        hooks: None in scenes without.
        strings: Of a strain test; None in scenes without.
    """

    tiers: tuple[tuple[float, float], ...] = ()
    removed: int | None = None
    lift: Lift | None = None
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
        """How far the wall has been lifted [m]; None once it is gone.

        Args:
            time: [s].
            phase: Index of the phase at that time.
            top: Height of the pile's top above the floor [m]; a wall that is lifted clear of it is gone.
        """
        if self.removed is None or phase < self.removed:
            return 0.0
        if self.lift is None:
            return None
        raised = self.lift.speed * (min(max(time, self.lift.start), self.lift.end) - self.lift.start)
        return raised if raised <= top else None


def read_surroundings(run: Run) -> Surroundings:
    """What the scene of a run says of its container and hooks, and where the series says that they are.

    Raises:
        InputError: `scene.yaml` or `series.h5` is damaged, or lacks what it should have.
    """
    scene = run.scene
    series = run.series if run.has_series else None
    hooks = scene.get("hooks")
    removed = next((phase.index for phase in run.phases if phase.type == _REMOVAL), None)
    return Surroundings(
        tiers=tuple((tier.radius, tier.top) for tier in read_tiers(run)),
        removed=removed,
        lift=None if removed is None else _lift(run, scene["phases"][removed], series, removed),
        hooks=None if hooks is None else DrawnHooks.of(hooks, series),
        strings=read_strings(run) if run.manifest.planar else None,
    )


def _lift(run: Run, phase: SceneData, series: Series | None, index: int) -> Lift | None:
    if phase.get("speed_m_per_s") is None:
        return None
    start = run.phases[index].start_s
    if start is None:
        # Not done yet: the phase began with the last sample of the one before.
        if series is None:
            return None
        start = float(series.time[series["phase"] < index].max(initial=0.0))
    return Lift(start=start, end=start + phase["duration_s"], speed=phase["speed_m_per_s"])
