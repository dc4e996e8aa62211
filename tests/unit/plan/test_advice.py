"""What is told of a scene before it runs: intervals longer than the run, hooks that one smarticle can hold."""

from __future__ import annotations

import json
from typing import Any

import pytest
from scenes import small

from dem.plan.advice import warnings_of
from dem.plan.outlook import plan

DEPOSIT, RELAX, PULL = {"type": "deposit", "per_layer": 5}, {"type": "relax", "duration_s": 0.1}, {"type": "pull-hook"}
W = 0.0117


def test_a_plain_scene_has_no_warnings() -> None:
    assert warnings_of(small()) == ()
    assert plan(small()).warnings == ()


def test_length_of_a_run_is_estimated_where_a_pour_is_in_it() -> None:
    planned, phases = plan(small()), small().phases
    length = sum(phase.expected_duration(10) for phase in phases)
    # Two layers of 0.125 s, 0.35 s to settle, 0.1 s of rest, 0.2 s of shaking.
    assert length == pytest.approx(0.9)
    assert length == pytest.approx(sum(phase.estimate_s for phase in planned.phases))
    assert [phase.known_duration for phase in phases] == [None, 0.1, 0.2]


@pytest.mark.parametrize(
    ("key", "left_out"), [("frame_interval_s", "no frame is written"), ("sphere_interval_s", "no spheres are written")]
)
def test_an_interval_longer_than_the_run_is_told(key: str, left_out: str) -> None:
    assert warnings_of(small({f"recording.{key}": 0.88})) == ()
    scene = small({f"recording.{key}": 10.0})
    (told,) = plan(scene).warnings
    assert told == (
        f"recording.{key}: 10 s is longer than the whole run, about 0.9 s, so that {left_out}; shorten it, or lengthen "
        "the run"
    )
    assert told == warnings_of(scene)[0]
    assert f"warning: {told}" in plan(scene).to_text().splitlines()
    assert json.loads(json.dumps(plan(scene).to_dict()))["warnings"] == [told]


def test_samples_further_apart_than_a_pour_are_told() -> None:
    recording = {"series_interval_s": 1.0, "frame_interval_s": 1.0, "checkpoint_interval_s": None}
    told = warnings_of(small({"phases": [DEPOSIT], "recording": recording}))
    assert [line.partition(":")[0] for line in told] == ["recording.series_interval_s", "recording.frame_interval_s"]
    assert "one sample is taken, at the start" in told[0]


def hooked(phases: list[dict[str, Any]], **hooks: float) -> tuple[str, ...]:
    return warnings_of(small({"hooks": hooks, "phases": phases, "count": 300}))


def test_hooks_that_one_smarticle_can_hold_are_told() -> None:
    (told,) = hooked([DEPOSIT, RELAX, PULL])
    assert told == (
        "hooks.upper_height_m: the hooks are 0.0055 m from outside to outside, less than a smarticle's inner length, "
        "0.0104 m: one smarticle can hold both hooks, and then only the contacts give way; set them at least 0.00995 m "
        "apart, or give pull-hook a force_limit_N"
    )
    # A pull that stops in time, and hooks that stay where they are, pull nothing apart.
    assert hooked([DEPOSIT, RELAX, PULL | {"force_limit_N": 0.2}]) == ()
    assert hooked([DEPOSIT, RELAX]) == ()


@pytest.mark.parametrize(("count", "told"), [(10, True), (80, True), (130, False), (300, False)])
def test_a_hook_above_the_pile_is_told(count: int, told: bool) -> None:
    # Piles of 100 were measured to reach 15 to 17 mm with half of the smarticles below 6.1 to 6.6 mm; h is 10 mm.
    scene = small({"hooks": {}, "phases": [DEPOSIT, RELAX, {**PULL, "force_limit_N": 0.2}], "count": count})
    assert scene.loose_height == pytest.approx(1e-4 * count, rel=0.15)
    found = [line for line in warnings_of(scene) if f"0.01 m is about as high as {count} smarticles pile up" in line]
    assert len(found) == told
    assert warnings_of(small({"hooks": {}, "phases": [DEPOSIT, RELAX], "count": 10})) == ()


@pytest.mark.parametrize(("gamma", "told"), [(0, False), (0.5, True), (0.999, True), (1, False), (2, False)])
def test_shaking_that_never_lets_go_of_the_pile_is_told(gamma: float, told: bool) -> None:
    found = warnings_of(small({"phases.2.peak_acceleration_g": gamma}))
    assert [f"phases.2.peak_acceleration_g: Γ = {gamma:g} is below 1" in line for line in found] == [True] * told


@pytest.mark.parametrize(
    ("wall_s", "told"),
    [(1.23, "1.2 s"), (59.4, "59 s"), (599, "599 s"), (601, "10 min"), (7300, "2.0 h"), (68_400, "19 h")],
)
def test_a_wall_time_is_told_in_the_unit_that_a_person_thinks_in(wall_s: float, told: str) -> None:
    planned = plan(small())
    lines = planned.corrected(wall_s / planned.wall_s).to_text().splitlines()
    (total,) = [line for line in lines if line.startswith("total")]
    assert total.endswith(f" {told}")


def test_hooks_that_are_far_enough_apart_are_not() -> None:
    enough = W - small().sphere_diameter - 0.5e-3
    for apart, count in ((0.99 * enough, 1), (1.01 * enough, 0)):
        found = hooked([DEPOSIT, RELAX, PULL], lower_height_m=5e-3, upper_height_m=5e-3 + apart)
        assert len(found) == count


def test_knobs_that_do_nothing_on_links_are_told_where_they_are_set() -> None:
    assert warnings_of(small({"engine": "links"})) == ()
    knobs = {"base": "draft", "pitch": 0.5, "wall_facets": 128}
    assert warnings_of(small({"fidelity": knobs})) == ()
    (told,) = warnings_of(small({"engine": "links", "fidelity": knobs}))
    assert told == (
        "fidelity: pitch (0.5), wall_facets (128) have no meaning on the engine links; leave out what does nothing"
    )


def test_a_plan_says_what_is_different_on_links() -> None:
    lines = plan(small({"engine": "links", "fidelity": "reference"})).to_text().splitlines()
    assert "smarticles of smooth links of 2 strands" in lines[0]
    assert lines[1] == (
        "engine links: fidelity.rows are strands; pitch, wall_facets, hinge_stiffness_N_per_m have no meaning here"
    )
