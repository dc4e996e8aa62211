"""What motors did, from samples far apart: known sums, and which frames are samples."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dem.record.frames import FrameSequence
from postprocess.measures.motors import MEASURES, sampled, sampled_work


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


def test_samples_are_the_frames_at_multiples_from_the_first() -> None:
    # Frames fall on the step that is nearest to their time.
    times = (np.arange(12) * 0.05 + 0.3 + np.tile([0.0, 3e-5, -4e-5], 4)).tolist()
    assert sampled(frames(times)) == [0, 2, 4, 6, 8, 10]


class Swinging(FrameSequence):
    """Frames every 25 ms of one barb that turns by 2 rad/s against a torque that grows from 1 N m by 1 N m/s."""

    def __getitem__(self, index):  # type: ignore[no-untyped-def]
        if isinstance(index, slice):
            return Swinging(self.times[index], self.paths[index])
        time = self.times[index]
        angles, torques = np.zeros((1, 3)), np.zeros((1, 3))
        angles[0, 0], torques[0, 0] = 2 * time, 1 + time
        return SimpleNamespace(cell_data={"angle_rad": angles, "motor_torque_N_m": torques})

    def in_phase(self, phase: int) -> FrameSequence:
        return self


def test_every_beginning_within_the_first_tenth_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    times = np.arange(13) * 0.025
    swinging = Swinging(times, tuple(Path(f"{k}.vtu") for k in range(13)))
    first, least, most = MEASURES[0].take(SimpleNamespace(frames=swinging), None, 2)  # type: ignore[arg-type]
    # Samples at 0, 0.1, 0.2, 0.3: 0.2 rad each against 1.1, 1.2, 1.3 N m; from 0.025 on there are two ways only.
    assert first == pytest.approx(0.2 * (1.1 + 1.2 + 1.3))
    assert most == pytest.approx(first)
    assert least == pytest.approx(0.2 * (1.125 + 1.225))
