"""Measure the pull of a hook out of a pile: force against time, peak force, work, time of coming free.

The force is the one that raises the hook, positive upwards; the smarticles exert the opposite force on the hook. A
sample of the series is the mean over the time since the previous sample. Single samples scatter, because contacts open
and close; the peak force is therefore the largest mean over a window.
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
"""Time over which the peak force is averaged [s]; at w per second a hook rises by 0.47 mm meanwhile, less than t2."""

FREE = 0.1  #: A hook is free once its force stays below this fraction of the peak force [-]
END = 0.1  #: Time at the end of the pull over which the remaining force is averaged [s]


@dataclass(frozen=True, kw_only=True, eq=False)
class HookPull:
    """Forces and heights of the two hooks during a pull of the upper hook, at n samples."""

    edges: Floats = field(repr=False)  #: (n + 1,) times [s]: 0 at the last sample before the pull, then the n samples
    raised: Floats = field(repr=False)  #: (n + 1,) distance by which the upper hook has been raised at `edges` [m]
    force: Floats = field(repr=False)  #: (n,) force that raises the upper hook, mean between two `edges` [N]
    #: (n,) upward force of the smarticles on the lower hook, mean between two `edges` [N]
    held: Floats = field(repr=False)
    before: float  #: Mean force on the upper hook before the pull [N]: weight on it; negative if pushed up
    engine_work: float  #: Work of the hook on the smarticles by the engine's energy ledger [J]; NaN if not recorded
    #: Error of the energy ledger over the pull, over the energy dissipated meanwhile [-]; NaN without a ledger
    residual: float

    @property
    def times(self) -> Floats:
        """Middles of the intervals over which forces are averaged: (n,) times since the pull began [s]."""
        middles: Floats = (self.edges[:-1] + self.edges[1:]) / 2
        return middles

    @property
    def work(self) -> float:
        """Work of the hook, ∫ F dz over the whole pull [J]."""
        return float(self.force @ np.diff(self.raised))

    @property
    def net(self) -> HookPull:
        """The pull with `force` less `held`: the force on the upper hook that the lower hook does not bear."""
        return replace(self, force=self.force - self.held)

    @property
    def left(self) -> float:
        """Mean force over the last `END` seconds of the pull [N]: friction and the weight still on the hook."""
        return float(self.force[self.times > self.edges[-1] - END].mean())


@dataclass(frozen=True, kw_only=True)
class Peak:
    """The largest force of a pull."""

    force: float  #: Mean force over the window [N]
    time: float  #: Time of the window's middle, since the pull began [s]
    raised: float  #: Distance by which the hook had been raised at this time [m]


def read_pull(run: Run, series: Series, phase: int) -> HookPull:
    """Read forces and heights of the hooks in the phase with the given index, as far as the run has come.

    InputError if the series lacks the hook's force or height, or has fewer than two samples of the phase.
    """
    inside = np.nonzero(series["phase"] == phase)[0]
    force = -series["hook_upper_force_N"][:, 2]
    # Hooks move with the container.
    height = series["hook_upper_z_m"] - series["container_z_m"]
    if len(inside) < 2 or inside[0] == 0 or not np.isfinite(force[inside]).all():
        raise InputError(f"{series.path}: no force of a hook throughout phase {phase} of {run.path}; run it again")
    span = np.concatenate([[inside[0] - 1], inside])
    resting = force[: inside[0]][series["phase"][: inside[0]] == phase - 1]
    resting = resting[np.isfinite(resting)][-_samples(END, interval_of(series.time[span]), len(inside)) :]
    changes = {
        name: float(series[name][span[-1]] - series[name][span[0]]) if name in series.data else math.nan
        for name in ("container_work_J", "energy_residual_J", "dissipated_energy_J")
    }
    return HookPull(
        edges=series.time[span] - series.time[span[0]],
        raised=height[span] - height[span[0]],
        force=force[inside],
        held=series["hook_lower_force_N"][inside, 2],
        before=float(resting.mean()) if len(resting) else math.nan,
        engine_work=changes["container_work_J"],
        residual=changes["energy_residual_J"] / (changes["dissipated_energy_J"] or math.nan),
    )


def weight_of_one(run: Run) -> float:
    """Return the weight of one smarticle, W_s [N]."""
    return float(run.manifest.smarticle_mass_kg * run.scene["gravity_m_per_s2"])


def moving_mean(pull: HookPull, window: float = WINDOW) -> tuple[Floats, Floats]:
    """Return the moving mean of the force: middles of the windows (m,) [s] and mean forces (m,) [N]."""
    interval = interval_of(pull.edges)
    return averaged(pull.times, interval, window), averaged(pull.force, interval, window)


def averaged(values: Floats, interval: float, window: float = WINDOW) -> Floats:
    """Return the moving mean (m,) of values (n,) at samples that are an `interval` [s] apart.

    The window [s] is rounded to whole samples: at least one, at most all.
    """
    count = _samples(window, interval, len(values))
    return np.convolve(values, np.full(count, 1 / count), mode="valid")


def interval_of(times: Floats) -> float:
    """Return the median time between successive samples [s], by their times (n,) [s]."""
    return float(np.median(np.diff(times)))


def peak(pull: HookPull, window: float = WINDOW) -> Peak:
    """Return the peak of a pull: the largest mean force over a window [s]."""
    times, means = moving_mean(pull, window)
    highest = int(means.argmax())
    time = float(times[highest])
    return Peak(force=float(means[highest]), time=time, raised=float(np.interp(time, pull.edges, pull.raised)))


def lost_after(pull: HookPull, highest: Peak, way: float) -> float:
    """Return the share of the peak force that is lost, on average over a `way` [m] of the hook beyond the peak [-].

    It is 1 − ∫ F dz / (F_peak way): 0 if the force stays, 1/2 if it falls linearly to 0 over the way, 1 if it is gone
    at once. NaN if the hook is raised by less than the way after the peak.
    """
    begin, end = highest.raised, highest.raised + way
    if end > pull.raised[-1]:
        return math.nan
    work = np.concatenate([[0.0], np.cumsum(pull.force * np.diff(pull.raised))])
    done = np.interp([begin, end], pull.raised, work)
    return float(1 - (done[1] - done[0]) / highest.force / way)


def held_at(pull: HookPull, time: float) -> float:
    """Return the mean force on the lower hook [N] over a window around a time since the pull began [s]."""
    times, means = moving_mean(replace(pull, force=pull.held))
    return float(np.interp(time, times, means))


def freed(pull: HookPull) -> float:
    """Return the time since the pull began [s] at which the hook came free, see `FREE`; NaN if it did not."""
    times, means = moving_mean(pull)
    held = np.nonzero(means > FREE * means.max())[0]
    if not len(held) or held[-1] + 1 == len(means):
        return math.nan
    return float(times[held[-1] + 1])


def held_fast(ways: Floats, asked: SceneData) -> bool:
    """Return whether a force limit stopped the hook or grip that has moved by `ways` (n,) [m] in a finished phase.

    The peak force is then a lower bound. `asked` is the scene's entry for this phase.
    """
    if asked.get("force_limit_N") is None:
        return False  # nothing else stops it
    # The last sample may be one interval before the arrival.
    last = ways[-1] + np.diff(ways).max()
    return bool(last < 0.99 * asked["distance_m"])


def _pull_of(run: Run, series: Series, phase: int) -> tuple[float, ...]:
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
        pull.left / weight * run.manifest.smarticle_mass_kg,
        float(pull.raised[-1]),
        float(held_fast(pull.raised, run.scene["phases"][phase])) if ended else math.nan,
    )


def has_pull(series: Series, phase: int) -> bool:
    """Return whether a series holds at least two samples of the hook's force in the phase with this index."""
    return "hook_upper_force_N" in series.data and int((series["phase"] == phase).sum()) >= 2


def _samples(window: float, interval: float, most: int) -> int:
    """Return how many samples, an `interval` [s] apart, a window [s] holds: at least one, at most `most`."""
    return min(max(round(window / interval), 1), most)


MEASURES = (
    PhaseMeasure(
        name="pull of a hook",
        phases=(PULL,),
        quantities=(
            Quantity("hook peak force over n W_s", "-", Shown(heading="peak F/nW", place=40, form=".3f")),
            Quantity("hook peak time", "s"),
            Quantity("hook peak raised", "m"),
            Quantity("lower hook force at the peak over n W_s", "-", Shown(heading="lower F/nW", place=40, form=".3f")),
            Quantity("hook work", "J", Shown(heading="hook work [mJ]", place=41, form=".3g", factor=1e3)),
            Quantity("hook free time", "s"),
            Quantity("hook load at the end", "smarticles"),
            Quantity("hook load mass at the end", "kg"),
            Quantity("hook raised at the end", "m"),
            Quantity("hook held fast", "-"),
        ),
        take=_pull_of,
        available_for=has_pull,
    ),
)
