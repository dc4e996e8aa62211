"""Measure the work of motors in a phase from samples every 0.1 s, as Savoie et al.'s code does.

Savoie et al., Soft Matter 2023, define the work as the integral of τ dα; `motor_work_J` of the series sums it over
every step. Their code stores torque and angle every 0.1 s (CheckPointSmarticles.cpp of `wsavoie/SmarticleSim`). A sum
over such samples underestimates the work of a barb that oscillates faster than that. Because the time of the first
sample is arbitrary, tables also state the least and the greatest sum over all possible first frames.
"""

import math

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameSequence
from dem.record.run import Run
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.registry import PhaseMeasure, Quantity

APART = 0.1  #: Time between two samples, as in the paper's code [s]
ACTUATED = ("actuate", "internal-oscillation", "shape-change")  #: Types of phase in which motors move barbs

_SAMPLED = f"motor work sampled every {APART:g} s"
_WORK = Quantity(_SAMPLED, "J")
_EXTREMES = Quantity(f"{_SAMPLED} least", "J"), Quantity(f"{_SAMPLED} greatest", "J")

SAMPLED_WORK = _WORK.header  #: Column of the sampled work in tables with one row per phase

_NEAR = 1e-3  # largest deviation of a frame from its time, over the interval; frames fall on the nearest step


def sampled_work(angles: Floats, torques: Floats) -> float:
    """Compute the sampled work [J]: the sum of τ Δα over all barbs and samples; NaN below two samples.

    Δα is the change of the angle since the previous sample. InputError if the arrays differ in shape.
    Angles are (samples, N, 2) [rad], torques of the motors (samples, N, 2) [N m].
    """
    if angles.shape != torques.shape:
        raise InputError(f"angles and torques must be of one shape: got {angles.shape} and {torques.shape}")
    if len(angles) < 2:
        return math.nan
    return float((torques[1:] * np.diff(angles, axis=0)).sum())


def sampled(frames: FrameSequence) -> list[int]:
    """Return the indices of frames at intervals of `APART`, from the first frame on.

    The list is empty if a frame is missing at one of these times.
    """
    if not len(frames):
        return []
    multiples = (frames.times - frames.times[0]) / APART
    chosen = np.flatnonzero(np.abs(multiples - np.round(multiples)) < _NEAR)
    complete = np.array_equal(np.round(multiples[chosen]), np.arange(len(chosen)))
    return [int(k) for k in chosen] if complete else []


def _sampled_work_of(run: Run, series: Series, phase: int) -> tuple[float, ...]:
    """Return the sampled work of a phase [J], and the least and greatest value over all first samples.

    The first value has the first frame of the phase as its first sample. For the other two the first sample is each
    frame within the first 0.1 s of the phase. All three are NaN if the work is unknown for each first sample.
    """
    frames = run.frames.in_phase(phase)
    firsts = int((frames.times - frames.times[:1] < APART * (1 - _NEAR)).sum())
    works = [_work_of([frames[first + k] for k in sampled(frames[first:])]) for first in range(firsts)]
    known = [work for work in works if not math.isnan(work)]
    return (works[0], min(known), max(known)) if known else (math.nan,) * 3


def _work_of(samples: list[Frame]) -> float:
    if not samples or any("motor_torque_N_m" not in frame.cell_data for frame in samples):
        return math.nan
    angles, torques = (
        np.array([frame.cell_data[name][:, [0, 2]] for frame in samples]) for name in ("angle_rad", "motor_torque_N_m")
    )
    known = ~np.isnan(torques).any(axis=(1, 2))  # the first frame may precede the motors
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
