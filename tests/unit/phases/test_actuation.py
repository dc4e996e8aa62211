"""Actuated phases: presets, which smarticles move, where they begin, target angles over time."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import small

from dem.phases.actuated import ActuatedPhase, Drive, drive
from dem.scene.scene import Scene
from dem.setting.motion import Triangle

Active = Callable[..., Scene]

SHAPE_CHANGE = {"type": "shape-change"}
OSCILLATION = {"type": "internal-oscillation", "theta_deg": 10}


@pytest.fixture
def active() -> Active:
    """A scene of a pour and the given phases."""

    def make(*phases: dict[str, Any], **changes: Any) -> Scene:
        dotted = {key.replace("__", "."): value for key, value in changes.items()}
        return small({"phases": [{"type": "deposit"}, *phases], **dotted})

    return make


def targets(driven: Drive, *times: float) -> NDArray[np.float64]:
    """(T, N, 2) [deg]."""
    return np.degrees([driven.targets(time) for time in times])


def same(one: Drive, other: Drive) -> bool:
    times = np.linspace(0, one.duration, 301)
    return (
        one.duration == other.duration
        and bool(np.array_equal(one.active, other.active))
        and all(np.array_equal(one.targets(time), other.targets(time)) for time in times)
    )


# -- presets -------------------------------------------------------------------------------------------------------


def test_shape_change_by_hand(active: Active) -> None:
    scene = active(SHAPE_CHANGE)
    driven = drive(scene, 1)
    assert scene.phases[1].duration_s == driven.duration == 3
    assert driven.active.all()
    angles = targets(driven, 0, 0.75, 1.5, 2.25, 3)
    assert angles.shape == (5, 10, 2)
    assert angles[:, 3, 1] == pytest.approx([90, 45, 0, 45, 90])
    assert np.ptp(angles, axis=(1, 2)) == pytest.approx(0)


@pytest.mark.parametrize(("ratio", "amplitude"), [(0.4, 8.75), (0.7, 5), (1.4, 2.5)])
def test_amplitude_rule_keeps_the_arc_of_the_tip(active: Active, ratio: float, amplitude: float) -> None:
    def wave(**changes: Any) -> Triangle:
        scene = active({**OSCILLATION, **changes}, smarticle__aspect_ratio=ratio, motor__speed_limit_rad_per_s=4)
        phase = scene.phases[1]
        assert isinstance(phase, ActuatedPhase)
        motion = phase.gait(scene.smarticle, scene.motor).motions[1]
        assert isinstance(motion, Triangle)
        return motion

    assert wave().amplitude_deg == pytest.approx(amplitude)
    assert wave(scaled=False).amplitude_deg == 5
    assert wave().speed_rad_per_s == 4
    assert wave().amplitude_deg * ratio == pytest.approx(5 * 0.7)  # times w in radians: the arc


# -- which smarticles move, from where, when -------------------------------------------------------------------------


def test_inactive_smarticles_keep_their_last_target(active: Active) -> None:
    ramp = {"type": "ramp", "to_deg": 30, "duration_s": 1}
    half = {"type": "actuate", "barbs": ramp, "active_fraction": 0.5}
    scene = active(half, half, SHAPE_CHANGE, count=20)
    first, second, last = (drive(scene, index) for index in (1, 2, 3))
    assert first.active.sum() == second.active.sum() == 10
    assert not np.array_equal(first.active, second.active)  # each phase draws anew
    expected = np.where(first.active, 60.0, 90.0)
    assert targets(first, 0.5)[0] == pytest.approx(np.stack([expected, expected], axis=1))
    # Those that have moved before start at 30°, the others at 90°.
    begun = np.where(first.active, 30.0, 90.0)
    middle = np.where(second.active, (begun + 30) / 2, begun)
    assert targets(second, 0, 0.5)[:, :, 1] == pytest.approx(np.array([begun, middle]))
    end = np.where(first.active | second.active, 30.0, 90.0)
    assert targets(last, 0, 0.75, 3)[:, :, 0] == pytest.approx(np.array([end, end / 2, end]))


def test_draws_follow_from_the_seed_alone(active: Active) -> None:
    phase = {**OSCILLATION, "active_fraction": 0.5, "offsets": "random"}

    def drawn(**changes: Any) -> Drive:
        return drive(active({**phase, **changes.pop("phase", {})}, count=200, **changes), 1)

    one = drawn(seed=3)
    assert same(one, drawn(seed=3))
    assert same(one, drawn(seed=3, fidelity="reference", name="other"))
    other = drawn(seed=4)
    assert not np.array_equal(one.active, other.active)
    assert one.active.sum() == other.active.sum() == 100
    both = one.active & other.active
    assert abs(one.targets(0) - other.targets(0))[both].max() > 0.01  # offsets are drawn anew as well
    again = drive(active(phase, phase, count=200, seed=3), 2)
    assert abs(one.targets(0) - again.targets(0))[one.active & again.active].max() > 0.01
    # A smaller share is part of a larger one, and each smarticle keeps its offset.
    fewer = drawn(seed=3, phase={"active_fraction": 0.1})
    assert fewer.active.sum() == 20
    assert not (fewer.active & ~one.active).any()
    assert fewer.targets(0.3)[fewer.active] == pytest.approx(one.targets(0.3)[fewer.active], abs=1e-12)


def test_random_offsets_are_spread_evenly_over_a_period(active: Active) -> None:
    phase = {**OSCILLATION, "theta_deg": 20, "offsets": "random"}
    scene = active(phase, count=2000)
    driven = drive(scene, 1)
    period = 4 * math.radians(10) / 6
    early, late = targets(driven, 0.0, period)
    assert early == pytest.approx(late, abs=1e-6)
    assert np.array_equal(early[:, 0], early[:, 1])  # the barbs of one smarticle keep their relation
    # A triangle at a uniformly drawn point: uniform between its extremes, half of them rising.
    counts, _ = np.histogram(early[:, 0], bins=10, range=(80, 100))
    assert counts.sum() == 2000
    assert abs(counts - 200).max() < 5 * math.sqrt(200 * 0.9)  # five standard deviations
    rising = (targets(driven, 1e-4)[0, :, 0] > early[:, 0]).mean()
    assert abs(rising - 0.5) < 5 * 0.5 / math.sqrt(2000)
    # The next phase begins where each of them ended.
    after = active(phase, SHAPE_CHANGE, count=2000)
    assert np.array_equal(drive(after, 2).targets(0), driven.targets(5))
    assert drive(after, 2).targets(3) == pytest.approx(driven.targets(5))
