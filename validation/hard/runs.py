"""Run scenes under a watchdog that records the largest fraction of each limit that a run reaches."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from dem.body.state import PileState
from dem.engine.interface import Engine
from dem.errors import InputError, RunError
from dem.physics.overlaps import Extremes, Overlaps
from dem.plan.steps import time_steps
from dem.record.progress import ProgressWriter
from dem.run import build, run
from dem.run.recorder import Recorder
from dem.run.watchdog import Watchdog
from dem.scene.scene import Scene
from validation.bench import scene_of
from validation.cases import Check, below, near


@dataclass(kw_only=True)
class Noting(Watchdog):
    """Watchdog that records the largest fraction of each limit that a run reaches."""

    nearest: dict[str, float] = field(default_factory=dict)  #: Largest fraction of each limit [1]

    def _note(self, limit: str, share: float) -> None:
        self.nearest[limit] = max(self.nearest.get(limit, 0.0), float(share))

    def content(self, extremes: Extremes, **options: Any) -> bool:
        """Return False, so that the watchdog examines all contacts at every check."""
        return False

    def check(self, state: PileState, **options: Any) -> None:
        """Record the largest gap of a hinge, then check the state as `Watchdog` does."""
        if (gaps := options.get("gaps")) is not None:
            self._note("gap", gaps.max(initial=0.0) / self.gap)
        super().check(state, **options)

    def check_depths(self, overlaps: Overlaps, **options: Any) -> None:
        """Record the deepest contact, then check the overlaps as `Watchdog` does."""
        self._note("depth", overlaps.deepest / self.depth)
        super().check_depths(overlaps, **options)

    def check_energy(self, state: PileState, *, energy: float, **options: Any) -> None:
        """Record the excess of energy, then check the energy as `Watchdog` does."""
        if np.isfinite(energy - self._ceiling):
            self._note("energy", (energy - self._ceiling) / self.energy)
        super().check_energy(state, energy=energy, **options)


@dataclass
class Watched:
    """Outcome of a run that has ended."""

    scene: Scene | None  #: The scene; None if the scene is not valid
    error: tuple[str, str] | None = None  #: Class and message of the error; None if the run is done
    series: dict[str, np.ndarray] = field(default_factory=dict)  #: Recorded series by name
    nearest: dict[str, float] = field(default_factory=dict)  #: Largest fraction of each limit of the watchdog [1]
    cost: float = 0.0  #: Share of the watchdog in the processor time, without its first check [1]
    first_check: float = 0.0  #: Processor time of the first check, which loads compiled code [s]

    @property
    def weight(self) -> float:
        """Weight of all smarticles [N]."""
        assert self.scene is not None
        return self.scene.count * self.scene.smarticle.boxes.mass * self.scene.gravity_m_per_s2

    @property
    def text(self) -> str | None:
        """Message of the error; None if the run is done."""
        return None if self.error is None else self.error[1]

    def during(self, phase: int) -> np.ndarray:
        """Return a mask that selects the samples of a phase from the series, (n,) bool."""
        mask: np.ndarray = self.series["phase"] == phase
        return mask

    def sound(self, *, rest: float | None = 0.02) -> list[Check]:
        """Return the checks that hold for every successful run, on its end, overlaps, energy and final speed.

        `rest` is the limit of the speed at the end [m/s]; None: not checked.
        """
        checks = [Check("ends", "done" if self.error is None else ": ".join(self.error), "done", self.error is None)]
        if self.error is not None:
            return checks
        assert self.scene is not None
        names = ("kinetic_energy_J", "com_height_m", "max_speed_m_per_s", "container_force_N")
        # The first sample has no smarticles, and NaN.
        broken = sum(int((~np.isfinite(self.series[name][1:])).sum()) for name in names)
        height, half = float(self.series["com_height_m"][-1]), self.scene.cylinder.height / 2
        rise = self.nearest.get("energy", 0.0)
        checks += [
            below("samples that are no numbers [1]", broken, 0.5),
            below("deepest contact at any check [d]", build.DEPTH_LIMIT * self.nearest.get("depth", 0.0), 0.5),
            near("height of the centre of mass at the end [m]", height, half, half),
            below("energy from nowhere over the watchdog's limit [1]", rise, 0.5),
        ]
        if rest is not None:
            checks.append(below("speed at the end [m/s]", float(self.series["max_speed_m_per_s"][-1]), rest))
        if "gap" in self.nearest:
            checks.append(below("largest joint gap [d]", build.GAP_LIMIT * self.nearest["gap"], 0.02))
        return checks

    def weight_on_floor(self, error: float) -> list[Check]:
        """Return a check that the final force on the container is the weight, within a relative error [1]."""
        if self.error is not None:
            return []
        force = float(self.series["container_force_N"][-5:, 2].mean())
        return [near("mean force on the container over the weight [1]", -force / self.weight, 1.0, error)]


def whole(
    data: dict[str, Any],
    out: Path,
    *,
    note: bool = True,
    steps: Callable[[Scene], Sequence[float]] = time_steps,
    spoil: Callable[[Engine], None] | None = None,
) -> Watched:
    """Run a scene and return the outcome.

    `note` records the largest fraction of each limit of the watchdog, which then examines all contacts at every check.
    `steps` returns the time step of each phase [s], by default those of `smarticles run`. `spoil` changes the engine
    before each sample of the series.
    """
    nearest: dict[str, float] = {}
    checks: list[float] = []  # processor time of each check of the watchdog [s]

    def recorder(scene: Scene, out: Path, progress: ProgressWriter) -> Recorder:
        made = build.build_recorder(scene, out, progress)
        if note:
            made.watchdog = Noting(**vars(made.watchdog), nearest=nearest)
        record, watch = made.record, made.watch

        def spoil_and_record(engine: Engine, phase: int) -> None:
            if spoil is not None:
                spoil(engine)
            record(engine, phase)

        def watch_timed(engine: Engine, state: PileState | None = None) -> None:
            begun = time.process_time()
            try:
                watch(engine, state)
            finally:
                checks.append(time.process_time() - begun)

        made.record, made.watch = spoil_and_record, watch_timed  # type: ignore[method-assign]
        return made

    scene, error = None, None
    builders = build.Builders(steps=steps, recorder=recorder)
    begun = time.process_time()
    try:
        scene = scene_of(data)
        run.run_scene(scene, out, command="stability", builders=builders)
    except (InputError, RunError) as caught:
        error = type(caught).__name__, str(caught)
    total = time.process_time() - begun
    series = {}
    if (out / "series.h5").exists():
        with h5py.File(out / "series.h5") as file:
            series = {name: dataset[()] for name, dataset in file.items()}
    return Watched(scene, error, series, nearest, sum(checks[1:]) / total, checks[0] if checks else 0.0)


def timed(run: Callable[..., list[Check]], *arguments: Any, **options: Any) -> tuple[list[Check], float]:
    """Run a case; return its checks and its wall time [s]."""
    begun = time.monotonic()
    return run(*arguments, **options), time.monotonic() - begun
