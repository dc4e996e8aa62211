"""Measure the pull of a hook out of a pile: force against time, peak, work, whether it came free.

Forces are those that it takes to raise the hook, upwards positive: what the smarticles exert on it, with the other
sign. The series holds means between samples, so nothing is missed between two of them, but contacts come and go and
one sample scatters: a peak is the largest mean over a window.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from dem.errors import InputError
from dem.record.run import Run, SceneData
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.registry import PhaseMeasure, Quantity, Shown

PULL = "pull-hook"  #: Type of the phase

WINDOW = 0.04
"""Over which forces are averaged for a peak [s]: at w per second the hook rises by 0.47 mm meanwhile, less than t2."""

FREE = 0.1  #: A hook is free once its force stays below this share of the peak [-]
END = 0.1  #: At the end of the pull, over which the force is averaged that is left [s]


@dataclass(frozen=True, kw_only=True, eq=False)
class HookPull:
    """A hook's history while it is pulled."""

    edges: Floats = field(repr=False)  #: (n + 1,) times since the pull began, of samples and of the one before them [s]
    raised: Floats = field(repr=False)  #: (n + 1,) how far the hook has been raised there [m]
    force: Floats = field(repr=False)  #: (n,) needed to raise it, mean between two samples [N]
    #: (n,) with which the smarticles pull the other hook upwards, likewise [N]: what goes from hook to hook
    held: Floats = field(repr=False)
    before: float  #: The force before the pull [N]: what rested on the hook; negative where it was held up
    engine_work: float  #: Work of the hook on the smarticles by the engine's own ledger [J]; NaN where not recorded

    @property
    def times(self) -> Floats:
        """(n,) middles of the intervals that forces are means over [s]."""
        middles: Floats = (self.edges[:-1] + self.edges[1:]) / 2
        return middles

    @property
    def work(self) -> float:
        """∫ F dz over the whole pull [J]; a hook that came free adds nothing from then on."""
        return float(self.force @ np.diff(self.raised))

    @property
    def net(self) -> HookPull:
        """The history with the force that does not go on to the other hook: that of pile and container."""
        return replace(self, force=self.force - self.held)

    @property
    def left(self) -> float:
        """Mean force over the last `END` of the pull [N]: what the hook still holds, less friction."""
        return float(self.force[self.times > self.edges[-1] - END].mean())


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The largest force of a pull."""

    force: float  #: Mean over the window [N]
    time: float  #: Of the window's middle, since the pull began [s]
    raised: float  #: How far the hook had been raised then [m]


def read_pull(run: Run, series: Series, phase: int) -> HookPull:
    """Read a hook's history in a phase, by its index, so far as it has come.

    Raises:
        InputError: The series lacks the hook's force or height, or does not reach into the phase.
    """
    inside = np.nonzero(series["phase"] == phase)[0]
    force = -series["hook_upper_force_N"][:, 2]
    # The hooks move with the container, which does not move now.
    height = series["hook_upper_z_m"]
    if len(inside) < 2 or inside[0] == 0 or not np.isfinite(force[inside]).all():
        raise InputError(f"{series.path}: no force of a hook throughout phase {phase} of {run.path}; run it again")
    span = np.concatenate([[inside[0] - 1], inside])
    resting = force[: inside[0]][series["phase"][: inside[0]] == phase - 1]
    resting = resting[np.isfinite(resting)][-max(1, _samples(series.time[span], END)) :]
    work = series.data.get("container_work_J")
    return HookPull(
        edges=series.time[span] - series.time[span[0]],
        raised=height[span] - height[span[0]],
        force=force[inside],
        held=series["hook_lower_force_N"][inside, 2],
        before=float(resting.mean()) if len(resting) else math.nan,
        engine_work=math.nan if work is None else float(work[span[-1]] - work[span[0]]),
    )


def weight_of_one(run: Run) -> float:
    """Return W_s, weight of one smarticle [N].

    Raises:
        InputError: The scene cannot be read, or lacks gravity.
    """
    return float(run.manifest.smarticle_mass_kg * run.scene["gravity_m_per_s2"])


def moving_mean(pull: HookPull, window: float = WINDOW) -> tuple[Floats, Floats]:
    """Average the force over every window: middles (m,) [s] and forces (m,) [N].

    The window [s] is rounded to whole samples, one at least, all at most.
    """
    count = _samples(pull.edges, window)
    weights = np.full(count, 1 / count)
    return np.convolve(pull.times, weights, mode="valid"), np.convolve(pull.force, weights, mode="valid")


def peak(pull: HookPull, window: float = WINDOW) -> Peak:
    """Return the largest mean over a window; arguments as in `moving_mean`."""
    times, means = moving_mean(pull, window)
    highest = int(means.argmax())
    time = float(times[highest])
    return Peak(force=float(means[highest]), time=time, raised=float(np.interp(time, pull.edges, pull.raised)))


def held_at(pull: HookPull, time: float) -> float:
    """Average the force on the other hook [N] over a window about a time since the pull began [s]."""
    times, means = moving_mean(replace(pull, force=pull.held))
    return float(np.interp(time, times, means))


def freed(pull: HookPull) -> float:
    """Return when the windowed force falls below `FREE` of its peak for good [s]; NaN if it never does."""
    times, means = moving_mean(pull)
    held = np.nonzero(means > FREE * means.max())[0]
    if not len(held) or held[-1] + 1 == len(means):
        return math.nan
    return float(times[held[-1] + 1])


def held_fast(pull: HookPull, asked: SceneData) -> bool:
    """Whether the hook was stopped by its force limit in a whole pull, so that its peak is a lower bound.

    Raises:
        InputError: The scene does not say how far.
    """
    # A hook that nothing stops arrives within a time step.
    return bool(pull.raised[-1] < 0.99 * asked["distance_m"])


def _pull_of(run: Run, series: Series, phase: int) -> tuple[float, ...]:
    """Measure a pull for a table, forces over the weight of all smarticles, n W_s."""
    pull, weight = read_pull(run, series, phase), weight_of_one(run)
    highest = peak(pull)
    ended = run.phases[phase].end_s is not None
    return (
        highest.force / weight / run.manifest.count,
        highest.time,
        highest.raised,
        held_at(pull, highest.time) / weight / run.manifest.count,
        pull.work,
        freed(pull),
        pull.left / weight,
        float(pull.raised[-1]),
        float(held_fast(pull, run.scene["phases"][phase])) if ended else math.nan,
    )


def has_pull(series: Series, phase: int) -> bool:
    """Whether there is enough of a pull in a series to measure."""
    return "hook_upper_force_N" in series.data and int((series["phase"] == phase).sum()) >= 2


def _samples(edges: Floats, window: float) -> int:
    """Return the samples in a window [s], one at least and all at most."""
    return min(max(round(window / float(np.median(np.diff(edges)))), 1), len(edges) - 1)


MEASURES = (
    PhaseMeasure(
        name="pull of a hook",
        phases=(PULL,),
        quantities=(
            Quantity("hook peak force over n W_s", "-", Shown(heading="peak F/nW", place=40, form=".3f")),
            Quantity("hook peak time", "s"),
            Quantity("hook peak raised", "m"),
            Quantity("lower hook force at the peak over n W_s", "-"),
            Quantity("hook work", "J", Shown(heading="hook work [mJ]", place=41, form=".3g", factor=1e3)),
            Quantity("hook free time", "s"),
            Quantity("hook load at the end", "smarticles"),
            Quantity("hook raised at the end", "m"),
            Quantity("hook held fast", "-"),
        ),
        take=_pull_of,
        available_for=has_pull,
    ),
)
