"""Chains in a plane: layout, bad input, servos and strings as arithmetic; no YADE."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from dem.body.chain import parted
from dem.body.state import State
from dem.errors import InputError
from dem.phases.actuation_checks import overshoot
from dem.phases.arrange import chain_of
from dem.physics.motor import MotorLaw, Motors
from dem.physics.strings import StringLaw
from dem.plan.outlook import plan
from dem.plan.steps import stable_step, time_step
from dem.scene.reading import dump_scene, parse_scene
from dem.scene.scene import Scene


def chain(**changes: Any) -> Scene:
    data: dict[str, Any] = {
        "schema_version": 1,
        "seed": 3,
        "count": 6,
        "smarticle": {
            "middle_length_m": 0.0467,
            "aspect_ratio": 1.0,
            "thickness_normal_m": 0.021,
            "thickness_in_plane_m": 0.0095,
            "density_kg_per_m3": 1250,
        },
        "plane": {"width_m": 0.1},
        "contact": {"restitution": 0.92},
        "motor": {"law": "servo", "torque_limit_N_m": 0.05, "stiffness_N_m_per_rad": 0.1},
        "fidelity": {"diameter_m": 0.0095, "pitch": 0.1, "stiffness_N_per_m": 7000, "control_interval_s": 1e-4},
        "phases": [{"type": "arrange", "gap_m": 0.00105}, {"type": "strain", "distance_m": 0.1}],
        "recording": {"series_interval_s": 1e-3, "frame_interval_s": 0.1, "checkpoint_interval_s": None},
    }
    for key, value in changes.items():
        place = data
        *path, last = key.split("__")
        for part in path:
            place = place[int(part) if isinstance(place, list) else part]
        place[int(last) if isinstance(place, list) else last] = value
    return parse_scene(data, source="chain.yaml")


def rest(scene: Scene) -> State:
    poses = chain_of(scene).poses()
    still = np.zeros_like(poses.positions)
    rotations = np.array([rotation.as_matrix() for rotation in poses.rotations])
    return State.rigid(scene.particle.boxes, poses.positions, rotations, still, still)


def test_the_chain_is_laid_out_hooked_and_a_gap_apart() -> None:
    scene = chain()
    layout, state, d = chain_of(scene), rest(scene), scene.sphere_diameter
    spheres = state.spheres(scene.particle)
    for k in range(5):
        apart = np.linalg.norm(spheres[k][:, None] - spheres[k + 1][None], axis=-1).min()
        # The nearest spheres of two rows need not face each other.
        assert apart == pytest.approx(d + layout.gap, rel=1e-4)
        # Hooked: the right barb of the left one is on the right of the other's left barb.
        assert state.vertices[k, :, 0].max() > state.vertices[k + 1, :, 0].min() + d
    for k in range(4):
        assert np.linalg.norm(spheres[k][:, None] - spheres[k + 2][None], axis=-1).min() >= d + layout.gap
    assert np.ptp(spheres[..., 1]) + d == pytest.approx(layout.width)
    assert layout.width == pytest.approx(0.062, abs=1e-9)
    assert state.positions.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    for tied_at, height in (("axis", 0.0), ("tip", None)):
        ends = [
            state.link_positions[tie.smarticle, tie.link]
            + tie.along * state.link_rotations[tie.smarticle, tie.link][:, 0]
            for tie in layout.ties(tied_at)  # type: ignore[arg-type]
        ]
        assert ends[1][0] - ends[0][0] == pytest.approx(layout.length)
        assert ends[0][1] == pytest.approx(-ends[1][1])
        if height is not None:
            assert ends[0][1] == pytest.approx(height, abs=1e-12)


def test_a_chain_has_parted_when_a_line_separates_two_neighbours() -> None:
    scene = chain()
    state, d = rest(scene), scene.sphere_diameter
    assert not parted(state, d)
    shift = np.zeros((6, 1, 3))
    shift[3:, 0, 0] = chain_of(scene).gap + 2.001 * d
    for factor, expected in ((0.99, False), (1.0, True)):
        moved = State(
            state.boxes,
            state.link_positions + factor * shift,
            state.link_rotations,
            state.link_velocities,
            state.link_spins,
        )
        assert parted(moved, d) is expected


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plane__width_m": 0.062}, "plane.width_m: H = 0.062 m leaves no room for a chain that is h = 0.062 m wide"),
        ({"plane__width_m": 0.16}, "is beyond the stroke of the servos: the chain gets no wider than 0.1401 m"),
        ({"plane": None}, "phases.0: arrange needs motion confined to a plane; add the key plane"),
        (
            {"phases__1__string_length_m": 0.001},
            "phases.1.string_length_m: 0.001 m does not reach the axis from a barb of a",
        ),
        ({"count": 1}, "count: 1 is no chain; use at least 2"),
        ({"phases__1": {"type": "shake"}}, "phases.1: shake has no meaning in a plane; use arrange, strain, relax"),
        ({"phases__0": {"type": "relax"}}, "phases.0: relax; a run in a plane starts with one 'arrange'"),
        ({"phases__0__gap_m": 0.01}, "phases.0.gap_m: two barbs of 0.0095 m and three gaps of 0.01 m do not fit"),
        ({"hooks": {}}, "hooks: they lie out of the plane; leave hooks or plane out"),
        ({"container": {"radius_m": 0.1}}, "container: a plane has none but two walls; leave container out"),
        ({"smarticle__angles_deg": [80, 90]}, "smarticle.angles_deg: a chain is laid out of U shapes, not of (80, 90)"),
        ({"phases__1__distance_m": 100}, "phases.1.distance_m: 100 means 100 m"),
        ({"motor__law": "halt", "motor__damping_N_m_s_per_rad": 1e-3}, "law is halt, which has none; use law: servo"),
        ({"motor__strength_spread": 1.0}, "motor.strength_spread: 1.0 is out of range; use less than 1"),
        ({"fidelity__rows": 2, "fidelity__diameter_m": 0.004}, "fidelity.rows: 2 rows of spheres out of the plane"),
    ],
)
def test_bad_input_is_told_in_one_line_with_its_key(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as told:
        chain(**changes)
    assert message in str(told.value)
    assert "\n" not in str(told.value)


def test_a_servo_must_look_at_every_step() -> None:
    assert time_step(chain()) == pytest.approx(1e-4)
    with pytest.raises(InputError, match=r"fidelity.control_interval_s: 0.0005 s is 5 time steps, but a servo"):
        time_step(chain(fidelity__control_interval_s=5e-4))


def test_a_stiff_string_shortens_the_stable_step() -> None:
    # A string whose mode is far above all others rules alone: the step goes as the square root of its softness.
    usual, steps = stable_step(chain()), []
    for stiffness in (1e9, 4e9):
        steps.append(
            stable_step(chain(phases__1__string_stiffness_N_per_m=stiffness, phases__1__string_damping_N_s_per_m=0))
        )
    assert steps[0] < usual / 30
    assert steps[0] / steps[1] == pytest.approx(2, rel=1e-3)
    assert stable_step(chain(phases__1__string_damping_N_s_per_m=1e6)) < usual / 1e3
    with pytest.raises(InputError, match="or softer contacts, servos and strings"):
        time_step(chain(phases__1__string_stiffness_N_per_m=1e9))


def test_a_servo_is_capped_and_so_not_warned_of() -> None:
    assert overshoot(chain(motor__torque_limit_N_m=1e-9)) == 0


def test_strengths_are_drawn_from_the_seed_within_the_spread() -> None:
    assert chain().motor_strengths is None
    strengths = chain(motor__strength_spread=0.1).motor_strengths
    assert strengths is not None
    assert strengths.shape == (6, 2)
    assert 0.02 < strengths.std() < 0.1
    assert np.abs(strengths - 1).max() <= 0.1
    again = chain(motor__strength_spread=0.1).motor_strengths
    assert (again == strengths).all()
    assert (chain(motor__strength_spread=0.1, seed=4).motor_strengths != strengths).all()


def test_a_servo_is_a_damped_spring_capped_as_a_whole_each_with_its_own_strength() -> None:
    law = MotorLaw(torque_limit=0.05, speed_limit=6.0, stiffness=0.1, law="servo", damping=1e-3)
    home, strengths = np.full((1, 2), 1.5), np.array([[1.0, 0.8]])
    motors = Motors(law, home, strengths)
    torques = motors.look(home - 0.2, home, 1e-4, 1e-4, np.full((1, 2), -2.0))
    assert torques == pytest.approx(np.array([[0.1 * 0.2 + 2e-3, 0.08 * 0.2 + 2e-3]]))
    assert not motors.halted.any()
    torques = motors.look(home - 0.49, home, 1e-4, 1e-4, np.full((1, 2), -2.0))
    assert torques == pytest.approx(np.array([[0.05, 0.04]]))
    # It remembers where it is to be, however far it was turned.
    assert (motors.commands == home).all()
    kept = Motors(law, home, strengths)
    kept.restore(motors.memory)
    after = [m.look(home - 0.1, home, 1e-4, 1e-4, np.zeros((1, 2))) for m in (motors, kept)]
    assert (after[0] == after[1]).all()
    assert (motors.work == kept.work).all()


def test_a_string_pulls_and_never_pushes() -> None:
    law = StringLaw(length=0.1, stiffness=5000.0, damping=2.0)
    assert law.tension(0.1001, 0.0) == pytest.approx(0.5)
    assert law.tension(0.1001, 0.1) == pytest.approx(0.7)
    assert law.tension(0.1001, -1.0) == 0
    assert law.tension(0.0999, 10.0) == 0


def test_the_plan_tells_plane_strings_and_servos() -> None:
    text = plan(chain(motor__strength_spread=0.1)).to_text()
    assert "two walls 100 mm apart" in text
    assert "h/H = 0.62" in text
    assert "strings" in text
    assert "servo" in text
    assert text.splitlines()[0].endswith("in a plane")


def test_the_scene_survives_its_own_dump() -> None:
    scene = chain()
    assert parse_scene(yaml.safe_load(dump_scene(scene)), source="dump") == scene
