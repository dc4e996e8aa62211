"""Measure the work of motors in a phase by samples far apart in time, as the paper's own code does.

The paper integrates τ dα over every step. Its own code keeps torque and angle together every 0.1 s only
(CheckPointSmarticles.cpp of `wsavoie/SmarticleSim`), and a sum over samples so far apart is another quantity: of a
barb that goes to and fro several times in between it is nearly nothing. Both stand beside each other in the tables:
the integral is `motor_work_J` of the series. Where the first sample lies is arbitrary: the least and the greatest sum
over all beginnings that the frames allow stand there too.
"""

from __future__ import annotations

import math

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameSequence
from dem.record.run import Run
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.registry import PhaseMeasure, Quantity

APART = 0.1  #: Between two samples, as in the paper's code [s]
ACTUATED = ("actuate", "internal-oscillation", "shape-change")  #: Types of phase in which motors move barbs

_SAMPLED = f"motor work sampled every {APART:g} s"
_WORK = Quantity(_SAMPLED, "J")
_EXTREMES = Quantity(f"{_SAMPLED} least", "J"), Quantity(f"{_SAMPLED} greatest", "J")

SAMPLED_WORK = _WORK.header  #: Its column in tables of phases

_NEAR = 1e-3  # share of the interval by which a frame may be off; frames fall on the nearest step


def sampled_work(angles: Floats, torques: Floats) -> float:
    """Sum τ Δα over all barbs [J], with Δα since the sample before; NaN of fewer than two samples.

    Angles [rad] and torques of the motors [N m] are (samples, N, 2).

    Raises:
        InputError: The two are not of one shape.

    Example:
        >>> import numpy as np
        >>> there, back = np.zeros((1, 1, 2)), np.full((1, 1, 2), 0.5)
        >>> sampled_work(np.concatenate([there, back]), np.full((2, 1, 2), 2e-3))
        0.002
    """
    if angles.shape != torques.shape:
        raise InputError(f"angles and torques must be of one shape: got {angles.shape} and {torques.shape}")
    if len(angles) < 2:
        return math.nan
    return float((torques[1:] * np.diff(angles, axis=0)).sum())


def sampled(frames: FrameSequence, apart: float = APART) -> list[int]:
    """Number the frames that are samples: the first one, and each that is a multiple of `apart` [s] later.

    None where frames do not fall on those times.
    """
    if not len(frames):
        return []
    multiples = (frames.times - frames.times[0]) / apart
    chosen = np.flatnonzero(np.abs(multiples - np.round(multiples)) < _NEAR)
    wanted = np.arange(len(chosen))
    return [int(k) for k in chosen] if np.array_equal(np.round(multiples[chosen]), wanted) else []


def _sampled_work_of(run: Run, series: Series, phase: int) -> tuple[float, ...]:
    """Sum from the first frame on, and least and greatest sum from any frame of the first 0.1 s."""
    frames = run.frames.in_phase(phase)
    begun = [sampled(frames[first:]) for first in range(int(np.searchsorted(frames.times, _first_end(frames))))]
    found = [_work_of([frames[first + k] for k in chosen]) for first, chosen in enumerate(begun)]
    known = [work for work in found if not math.isnan(work)]
    if not known:
        return (math.nan,) * 3
    return found[0], min(known), max(known)


def _first_end(frames: FrameSequence) -> float:
    """Return the time of the second sample from the first frame on [s]; -inf without frames."""
    return float(frames.times[0]) + APART * (1 - _NEAR) if len(frames) else -math.inf


def _work_of(samples: list[Frame]) -> float:
    if not samples or any("motor_torque_N_m" not in frame.cell_data for frame in samples):
        return math.nan
    angles, torques = (
        np.array([frame.cell_data[name][:, [0, 2]] for frame in samples]) for name in ("angle_rad", "motor_torque_N_m")
    )
    known = ~np.isnan(torques).any(axis=(1, 2))  # the first frame may be of before motors were there
    return sampled_work(angles[known], torques[known])


MEASURES = (
    PhaseMeasure(
        name="sampled motor work",
        phases=ACTUATED,
        quantities=(_WORK, *_EXTREMES),
        take=_sampled_work_of,
        available_for=lambda series, _: "motor_work_J" in series.data,
    ),
)
