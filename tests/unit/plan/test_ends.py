"""Scenes that cannot end well are rejected before anything is simulated, and no shipped scene is one of them."""

import math
import re
from typing import Any

import pytest
import yaml
from scenes import small

from dem.errors import InputError
from dem.plan.ends import check_ends
from dem.plan.steps import time_steps
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from smarticles.starters import KINDS, starter
from studies.registry import STUDIES
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep


def rejection(scene: Scene) -> str:
    with pytest.raises(InputError) as caught:
        time_steps(scene)
    return str(caught.value)


@pytest.mark.parametrize("kind", KINDS)
def test_scenes_to_begin_with_can_end(kind: str) -> None:
    check_ends(parse_scene(yaml.safe_load(starter(kind)), source=kind))


@pytest.mark.parametrize("name", STUDIES)
def test_scenes_of_studies_can_end(name: str) -> None:
    for point in expand(load_sweep(STUDIES[name].sweep_file(quick=False)))[::25]:
        check_ends(point.scene)


def test_a_pour_without_damping_is_rejected() -> None:
    assert rejection(small({"contact.restitution": 1})).startswith("contact.restitution: 1 means contacts without damp")
    time_steps(small({"contact.restitution": 0.99}))


@pytest.mark.parametrize("restitution", [0.3, 0.7])
def test_what_rebounds_over_the_wall_is_rejected_with_two_ways_out(restitution: float) -> None:
    def thrown(speed: float, height: float = 0.1) -> Scene:
        data = {"contact": {"restitution": restitution}, "phases.0.thrown_at_m_per_s": speed}
        return small(data | {"container": {"height_m": height}, "engine": "links"})

    # (e v)²/2g is the height of the wall at 1.4 m/s over e.
    error = rejection(thrown(1.41 / restitution))
    assert re.match(rf"phases\.0\.thrown_at_m_per_s: .* rebounds by 0\.101 m at .* = {restitution}, out of the", error)
    speed, height = re.search(r"use at most (\S+) m/s or container\.height_m: (\S+)$", error).groups()  # type: ignore[union-attr]
    assert float(speed) == pytest.approx(1.40 / restitution / 1.1**0.5, rel=0.01)
    time_steps(thrown(float(speed)))
    time_steps(thrown(1.41 / restitution, float(height)))


def test_what_the_floor_throws_over_the_wall_is_rejected_with_two_ways_out() -> None:
    def shaken(frequency: float, peak: float = 5, height: float = 0.05) -> Scene:
        shake = {"phases.2.frequency_hz": frequency, "phases.2.peak_acceleration_g": peak}
        stiff = {"engine": "links", "fidelity": {"base": "draft", "stiffness_N_per_m": 5000}}
        return small(shake | stiff | {"container": {"height_m": height}, "contact": {"restitution": 0.7}})

    error = rejection(shaken(13))
    rise, frequency, height = re.search(  # type: ignore[union-attr]
        r"^phases\.2\.frequency_hz: 13 Hz .* up by (\S+) m, .* at least (\S+) Hz or container\.height_m: (\S+)$", error
    ).groups()
    omega = 2 * math.pi * 13
    assert float(rise) == pytest.approx(49.05 / omega**2 + (1.7 * 49.05 / omega) ** 2 / 2 / 9.81, rel=0.01)
    time_steps(shaken(float(frequency)))
    time_steps(shaken(13, height=float(height)))
    time_steps(shaken(5, peak=1))  # nothing leaves the floor


@pytest.mark.parametrize(
    ("phase", "key"),
    [
        (
            {"type": "shake", "peak_acceleration_g": 1, "peak_acceleration_end_g": 15, "frequency_hz": 20},
            "frequency_hz",
        ),
        ({"type": "shake", "peak_acceleration_g": 5, "frequency_hz": 90, "frequency_end_hz": 8}, "frequency_end_hz"),
        (
            {
                "type": "tension",
                "grip_m": 0.005,
                "distance_m": 0.004,
                "speed_m_per_s": 0.01,
                "vibration": {"peak_acceleration_g": 15, "frequency_hz": 20},
            },
            "vibration.frequency_hz",
        ),
    ],
)
def test_the_key_is_named_that_throws_smarticles_over_the_wall(phase: dict[str, Any], key: str) -> None:
    with pytest.raises(InputError, match=rf"^phases\.1\.{key}: \S+ Hz at Γ = (5|15) throws smarticles up"):
        check_ends(small({"engine": "links", "container": {"height_m": 0.1}, "phases": [{"type": "deposit"}, phase]}))


def test_a_wall_that_is_taken_away_is_not_in_the_way() -> None:
    shake = {"type": "shake", "frequency_hz": 20, "peak_acceleration_g": 15}
    low = {"container": {"height_m": 0.1}}
    check_ends(small(low | {"phases": [{"type": "deposit"}, {"type": "remove-container"}, shake]}))
    with pytest.raises(InputError, match="throws smarticles up"):
        check_ends(small(low | {"phases": [{"type": "deposit"}, shake]}))


def test_a_few_smarticles_thrown_as_by_the_code_of_the_paper_are_accepted() -> None:
    for count, ratio in ((1, 0.0), (10, 0.4), (50, 0.0)):
        check_ends(small({"count": count, "smarticle.aspect_ratio": ratio, "phases.0.thrown_at_m_per_s": 2.0}))
    with pytest.raises(InputError, match="rebounds by"):
        check_ends(small({"phases.0.thrown_at_m_per_s": 3.0}))
