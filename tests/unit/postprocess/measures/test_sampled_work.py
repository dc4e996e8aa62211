"""What motors did, from samples far apart: known sums, and which frames are samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dem.errors import InputError
from dem.record.frames import FrameSequence
from postprocess.measures.motors import sampled, sampled_work


def frames(times: list[float]) -> FrameSequence:
    return FrameSequence(np.array(times), tuple(Path(f"{k}.vtu") for k in range(len(times))))


def test_a_constant_torque_gives_its_work() -> None:
    turns = np.linspace(0.0, 1.2, 7)[:, None, None] * np.ones((7, 5, 2))
    assert sampled_work(turns, np.full((7, 5, 2), 3e-3)) == pytest.approx(10 * 3e-3 * 1.2, rel=1e-12)


def test_what_goes_to_and_fro_in_between_is_not_seen() -> None:
    # A barb that swings at 20 Hz against 1 mN m of friction works 4 A τ in a period; seen every 0.1 s it stands still.
    amplitude, torque = 0.1, 1e-3
    times = np.arange(0, 1.05, 0.1)
    angles = amplitude * np.sin(2 * np.pi * 20 * times)[:, None, None] * np.ones((11, 1, 2))
    works = sampled_work(angles, np.full_like(angles, torque))
    assert abs(works) < 1e-3 * (2 * 20 * 4 * amplitude * torque)


def test_the_torque_is_that_at_the_end_of_each_way() -> None:
    angles, torques = np.zeros((3, 1, 2)), np.zeros((3, 1, 2))
    angles[1:, 0, 0], angles[2, 0, 1] = 0.5, -0.25
    torques[:, 0, 0], torques[:, 0, 1] = (7.0, 2.0, 5.0), (7.0, 7.0, -4.0)
    assert sampled_work(angles, torques) == pytest.approx(0.5 * 2.0 + 0.25 * 4.0)


def test_less_than_two_samples_tell_nothing_and_shapes_must_agree() -> None:
    assert np.isnan(sampled_work(np.zeros((1, 4, 2)), np.zeros((1, 4, 2))))
    with pytest.raises(InputError, match=r"one shape: got \(2, 4, 2\) and \(2, 3, 2\)"):
        sampled_work(np.zeros((2, 4, 2)), np.zeros((2, 3, 2)))


def test_samples_are_the_frames_at_multiples_from_the_first() -> None:
    # Frames fall on the step that is nearest to their time.
    times = (np.arange(12) * 0.05 + 0.3 + np.tile([0.0, 3e-5, -4e-5], 4)).tolist()
    assert sampled(frames(times)) == [0, 2, 4, 6, 8, 10]


def test_frames_that_fall_elsewhere_are_no_samples() -> None:
    assert sampled(frames([0.0, 0.04, 0.08, 0.12, 0.16, 0.2])) == []
    assert sampled(frames([])) == []
