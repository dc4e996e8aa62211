"""Whole runs of a scene, watched: how they ended, their series, and how near they came to the watchdog's limits."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from dem.body.state import State
from dem.engine.interface import Engine
from dem.errors import InputError, RunError
from dem.physics.overlaps import Glance, Overlaps
from dem.plan.steps import time_steps
from dem.record.progress import ProgressWriter
from dem.run import build, run
from dem.run.recorder import Recorder
from dem.run.watchdog import Watchdog
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from validation.check import Check, below, near


@dataclass(kw_only=True)
class Noting(Watchdog):
    """The same watchdog, which notes how near smarticles came to its limits.

    Args:
        nearest: largest share of each limit.
    """

    nearest: dict[str, float] = field(default_factory=dict)

    def _note(self, limit: str, share: float) -> None:
        self.nearest[limit] = max(self.nearest.get(limit, 0.0), float(share))

    def content(self, glance: Glance, **options: Any) -> bool:
        """See `Watchdog`; it is to look closely every time."""
        return False

    def check(self, state: State, **options: Any) -> None:
        """See `Watchdog`."""
        if state.count:
            self._note("speed", np.linalg.norm(state.link_velocities, axis=-1).max() / self.speed)
        if (gaps := options.get("gaps")) is not None:
            self._note("gap", gaps.max(initial=0.0) / self.gap)
        super().check(state, **options)

    def check_depths(self, overlaps: Overlaps, **options: Any) -> None:
        """See `Watchdog`."""
        self._note("depth", overlaps.deepest / self.depth)
        super().check_depths(overlaps, **options)

    def check_energy(self, state: State, *, energy: float, **options: Any) -> None:
        """See `Watchdog`."""
        if np.isfinite(energy - self._ceiling):
            self._note("energy", (energy - self._ceiling) / self.energy)
        super().check_energy(state, energy=energy, **options)


@dataclass
class Timing(Recorder):
    """The same recorder, which times the watchdog's looks, and spoils what it looks at.

    Args:
        looks: processor time of each [s].
        spoil: done to the engine before each record; None: nothing is.
    """

    looks: list[float] = field(default_factory=list)
    spoil: Callable[[Engine], None] | None = None

    def record(self, engine: Engine, phase: int) -> None:
        """See `Recorder`."""
        if self.spoil is not None:
            self.spoil(engine)
        super().record(engine, phase)

    def watch(self, engine: Engine, state: State | None = None) -> None:
        """See `Recorder`."""
        begun = time.process_time()
        try:
            super().watch(engine, state)
        finally:
            self.looks.append(time.process_time() - begun)


@dataclass
class Watched:
    """A run that has ended.

    Args:
        scene: what was run; None: it is not valid.
        error: kind and text of the error that it ended in; None: it was done.
        series: by name.
        nearest: largest share of each limit of the watchdog that was reached.
        cost: share of the processor time that the watchdog took, but for its first look [1].
        first_look: processor time of that, in which compiled code is loaded [s].
    """

    scene: Scene | None
    error: tuple[str, str] | None = None
    series: dict[str, np.ndarray] = field(default_factory=dict)
    nearest: dict[str, float] = field(default_factory=dict)
    cost: float = 0.0
    first_look: float = 0.0

    @property
    def weight(self) -> float:
        """Of all smarticles [N]."""
        assert self.scene is not None
        return self.scene.count * self.scene.smarticle.boxes.mass * self.scene.gravity_m_per_s2

    @property
    def text(self) -> str | None:
        """Text of the error."""
        return None if self.error is None else self.error[1]

    def during(self, phase: int) -> np.ndarray:
        """Which samples belong to a phase."""
        during: np.ndarray = self.series["phase"] == phase
        return during

    def sound(self, *, rest: float | None = 0.02, depth: float = 0.5) -> list[Check]:
        """What holds of every run that ended right."""
        checks = [Check("ends", "done" if self.error is None else ": ".join(self.error), "done", self.error is None)]
        if self.error is not None:
            return checks
        assert self.scene is not None
        names = ("kinetic_energy_J", "com_height_m", "max_speed_m_per_s", "container_force_N")
        # Nothing is there at the first sample.
        broken = sum(int((~np.isfinite(self.series[name][1:])).sum()) for name in names)
        height = float(self.series["com_height_m"][-1])
        checks += [
            below("samples that are no numbers [1]", broken, 0.5),
            below("deepest contact at any look [d]", build.DEPTH_LIMIT * self.nearest.get("depth", 0.0), depth),
            near(
                "height of the centre of mass at the end [m]",
                height,
                self.scene.cylinder.height / 2,
                self.scene.cylinder.height / 2,
            ),
            below("energy from nowhere over the watchdog's limit [1]", self.nearest.get("energy", 0.0), 0.5),
        ]
        if rest is not None:
            checks.append(below("speed at the end [m/s]", float(self.series["max_speed_m_per_s"][-1]), rest))
        if "gap" in self.nearest:
            gap = build.GAP_LIMIT * self.nearest["gap"]
            checks.append(below("largest joint gap [d]", gap, 0.02))
        return checks


def whole(
    data: dict[str, Any],
    out: Path,
    *,
    note: bool = True,
    steps: Callable[[Scene], Sequence[float]] = time_steps,
    spoil: Callable[[Engine], None] | None = None,
) -> Watched:
    """Run a scene into a run directory."""
    built: list[tuple[Timing, Noting | None]] = []

    def recorder(scene: Scene, out: Path, progress: ProgressWriter) -> Recorder:
        timing = Timing(**vars(build.build_recorder(scene, out, progress)), spoil=spoil)
        noting = Noting(**vars(timing.watchdog)) if note else None
        timing.watchdog = noting or timing.watchdog
        built.append((timing, noting))
        return timing

    scene, error = None, None
    begun = time.process_time()
    try:
        scene = parse_scene(data, source="case")
        run.run_scene(
            scene, out, command="stability", progress=False, builders=build.Builders(steps=steps, recorder=recorder)
        )
    except (InputError, RunError) as caught:
        error = type(caught).__name__, str(caught)
    total = time.process_time() - begun
    series = {}
    if (out / "series.h5").exists():
        with h5py.File(out / "series.h5") as file:
            series = {name: dataset[()] for name, dataset in file.items()}
    nearest = {limit: share for _, noting in built if noting for limit, share in noting.nearest.items()}
    looks = [look for timing, _ in built for look in timing.looks] or [0.0]
    return Watched(scene, error, series, nearest, sum(looks[1:]) / total, looks[0])
