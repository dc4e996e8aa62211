"""Reading scenes of chains of links: what they become, and what is rejected in one line."""

import math
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from scenes import small

from dem.errors import InputError
from dem.phases.undulate import Undulate
from dem.plan.outlook import plan
from dem.scene.reading import dump_scene, parse_scene, scene_hash
from dem.yaml_text import parse_yaml

MOTOR = {"law": "motor", "torque_limit_N_m": 1e-3, "stiffness_N_m_per_rad": 1e-3, "speed_limit_rad_per_s": 10}
CHAIN: dict[str, Any] = {"shape": "chain", "links": 4, "link_m": 0.01, "diameter_m": 0.002, "joints": MOTOR}
SCENE: dict[str, Any] = {
    "engine": "links",
    "count": 4,
    "particle": CHAIN,
    "container.radius_m": 0.05,
    "phases": [{"type": "deposit"}, {"type": "undulate", "duration_s": 1, "amplitude_deg": 30}],
}
TABLE = {"type": "undulate", "duration_s": 1, "joints": [{"joint": 1, "amplitude_deg": 20, "phase_deg": 90}]}


def rejected(changes: dict[str, Any]) -> str:
    with pytest.raises(InputError) as error:
        small(deepcopy(SCENE) | changes)
    return str(error.value).removeprefix("scene.yaml: ")


def test_links_and_joints_are_what_the_scene_says() -> None:
    joints = [
        {"law": "free", "axes": 3},
        {**MOTOR, "axes": [[0, 2, 0]], "poured_deg": 30},
        {"law": "elastic", "stiffness_N_m_per_rad": 1e-4, "axes": 2, "rest_angle_deg": [20, 10], "yield_N_m": 1e-5},
    ]
    scene = small(deepcopy(SCENE) | {"particle": {**CHAIN, "link_m": [0.01, 0.02, 0.01, 0.01], "joints": joints}})
    (kind,) = scene.bodies
    linkage = kind.linkage
    assert linkage is not None
    assert [float(link.lengths[0]) for link in linkage.links] == [0.01, 0.02, 0.01, 0.01]
    assert kind.mass == pytest.approx(7850 * math.pi * 1e-6 * 0.05)
    free, motor, elastic = linkage.joints
    assert [len(joint.axes) for joint in linkage.joints] == [3, 1, 2]
    assert motor.axes == ((0.0, 1.0, 0.0),)
    assert (free.law, motor.most, motor.speed, elastic.most) == ("free", 1e-3, 10, 1e-5)
    assert elastic.rest == elastic.poured == pytest.approx((math.radians(20), math.radians(10), 0))
    # As poured: the second joint bends about y, the third one about z of the link before and y of the link after.
    x = np.array([bars[:, 0] for bars in kind.bars.rotation @ kind.bars.frames])
    np.testing.assert_allclose(x[0] @ x[1], 1, atol=1e-12)
    np.testing.assert_allclose(x[1] @ x[2], math.cos(math.radians(30)), atol=1e-12)
    np.testing.assert_allclose(x[2] @ x[3], math.cos(math.radians(20)) * math.cos(math.radians(10)), atol=1e-12)


def test_a_written_scene_is_read_as_the_same_one() -> None:
    joints = [{"law": "free", "axes": 3}, {"law": "free", "axes": 2}, {**MOTOR, "axes": [[0.6, 0, 0.8]]}]
    scene = small(deepcopy(SCENE) | {"particle": {**CHAIN, "joints": joints}})
    again = parse_scene(parse_yaml(dump_scene(scene), "again"), source="again")
    assert scene_hash(again) == scene_hash(scene)


def test_an_undulation_is_a_wave_besides_the_motors_of_the_table() -> None:
    scene = small(
        deepcopy(SCENE) | {"phases.1": TABLE | {"amplitude_deg": 10, "wavelength_lengths": 0.5, "frequency_hz": 2}}
    )
    phase, linkage = scene.phases[1], scene.bodies[0].linkage
    assert isinstance(phase, Undulate)
    assert linkage is not None
    swings = {swing.joint: swing for swing in phase.undulation.swings_of(linkage)}
    assert math.degrees(swings[1].amplitude) == pytest.approx(20)
    assert math.degrees(swings[1].phase) == pytest.approx(90)
    assert math.degrees(swings[2].amplitude) == pytest.approx(10)
    # Joints are a quarter of the chain, half a wavelength, from each other.
    assert swings[2].phase - swings[0].phase == pytest.approx(-2 * math.pi)
    assert phase.undulation.rate == pytest.approx(4 * math.pi)


def test_a_plan_has_their_step_and_effects() -> None:
    found = plan(small(SCENE))
    assert found.time_step_s < found.stable_time_step_s < 1e-3
    (joints,) = [each for each in found.effects if each.name == "joints"]
    assert joints.on
    assert joints.why.startswith("3 motor")
    stiff = plan(small(deepcopy(SCENE) | {"particle.pin_stiffness_N_per_m": 1e5}))
    assert stiff.stable_time_step_s == pytest.approx(found.stable_time_step_s / math.sqrt(1e5 / 2000), rel=0.5)
    twisted = plan(
        small(deepcopy(SCENE) | {"particle.joints": {**MOTOR, "axes": [[1, 0, 0]], "damping_N_m_s_per_rad": 1e-3}})
    )
    assert any("particle.joints" in line for line in twisted.warnings)


@pytest.mark.parametrize(("changes", "message"), [
    ({"engine": "yade"}, "particle: chain on engine: yade, which has none; use engine: links"),
    ({"particle.link_m": 0}, "particle.link_m.0: 0 is out of range"),
    ({"particle.link_m": [0.01, 0.01]}, "particle.shape: chain: link_m: 2 lengths for links: 4; give one for all"),
    ({"particle.links": 1}, "particle.links: 1 is out of range; use at least 2"),
    ({"particle.link_m": 0.001}, "particle.shape: chain: bar 0: 0.001 m long; make it longer than its thickness"),
    ({"particle.joints": [MOTOR, MOTOR]}, "particle.shape: chain: joints: 2 for 4 links; give one for all, or a list"),
    ({"particle.joints": {**MOTOR, "axes": 4}}, "particle.joints.axes: got 4; give 1, 2 or 3"),
    ({"particle.joints": {**MOTOR, "axes": []}}, "particle.joints.axes: 0 directions; give one (a hinge) or two"),
    ({"particle.joints": {**MOTOR, "axes": [[0, 0, 0]]}}, "particle.joints.axes.0: a direction of length 0"),
    ({"particle.joints": {**MOTOR, "axes": [[0, 0, 1], [0, 1, 1]]}}, "particle.joints.axes: 45° apart; two axes"),
    ({"particle.joints": {**MOTOR, "poured_deg": [1, 2]}}, "particle.joints.poured_deg: 2 angles for 1 axes"),
    ({"particle.joints": {**MOTOR, "yield_N_m": 1}},
     "particle.joints: unknown key 'yield_N_m'; it belongs in law: elastic"),
    ({"particle.joints": {"law": "free", "stiffness_N_m_per_rad": 1}},
     "particle.joints: unknown key 'stiffness_N_m_per_rad'; it belongs in law: elastic or motor"),
    ({"phases.1.wavelength_lengths": 1e-318},
     "phases.1.wavelength_lengths: 1e-318 is out of range; use at least 0.001"),
    ({"particle.joints": {**MOTOR, "speed": 1}}, "particle.joints: unknown key 'speed'; did you mean"),
    ({"particle.joints": "motor"}, "particle.joints.0: 'motor' is not keys and values; write them as {law: …}"),
    ({"particle": [5]}, "particle.0: 5 is not keys and values; write them as {shape: …}"),
    ({"phases.1": "relax"}, "phases.1: 'relax' is not keys and values; write them as {type: …}"),
    ({"particle.joints": {"law": "motor"}}, "particle.joints.torque_limit_N_m: missing"),
    ({"particle.joints": {"law": "free", "poured_deg": 200}}, "particle.joints.poured_deg.0: 200"),
    ({"particle.joints": {"law": "free"}}, "phases.1: undulate needs motors, but no joint has law: motor"),
    ({"particle.joints": [MOTOR, {"law": "free"}, MOTOR], "phases.1": TABLE},
     "phases.1.joints.0.joint: joint 1 has no motor, but law: free"),
    ({"phases.1": {**TABLE, "joints": [{"joint": 3}]}},
     "phases.1.joints.0.joint: there is no joint 3 in a chain of 4 links; use 0 to 2"),
    ({"phases.1": {**TABLE, "joints": [{"joint": 2, "axis": 1}]}}, "phases.1.joints.0.axis: joint 2 has no axis 1"),
    ({"phases.1": {**TABLE, "joints": [{"joint": 2}, {"joint": 1}, {"joint": 2, "amplitude_deg": 9}]}},
     "phases.1.joints.2: joint 2, axis 0 moves by joints.0 already; leave one of them out"),
    ({"phases.1": {**TABLE, "frequency_hz": 10}},
     "phases.1.joints.0.amplitude_deg: 20° at 10 Hz needs 21.9 rad/s at joint 1, whose speed_limit_rad_per_s is 10"),
    ({"phases.1": {**TABLE, "joints": [{"joint": 1, "centre_deg": 140, "amplitude_deg": 20}]}},
     "phases.1.joints.0.amplitude_deg: 20° about 140° bends joint 1 by 160°; keep within 150°"),
    ({"particle": [CHAIN, {"shape": "rod", "length_m": 0.01}]}, "particle: chains and other shapes do not mix"),
    ({"particle": {"shape": "rod", "length_m": 0.01}}, "phases.1: undulate needs chains"),
    ({"liquid": {}}, "liquid: only filaments float in it"),
    ({"phases.1": {"type": "wriggle", "duration_s": 1, "curvature_per_m": 100}}, "phases.1: wriggle needs filaments"),
    ({"recording": {"contact_forces": True}}, "recording.contact_forces: forces at contacts of chains"),
    ({"plane": {}}, "plane: motion in a plane is that of smarticles"),
])  # fmt: skip
def test_one_line_says_what_is_wrong_and_what_to_do(changes: dict[str, Any], message: str) -> None:
    found = rejected(changes)
    assert found.startswith(message)
    assert "\n" not in found
