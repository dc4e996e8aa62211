"""A middle link thicker in the plane than the barbs: boxes, spheres and a chain laid out of them, by known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import chain
from scipy.spatial.transform import Rotation

from dem.body.chain import extent, parted
from dem.body.particle import Boxes, Particle, SphereChain, mean_width
from dem.body.state import State
from dem.engine.yade.kind import YadeKind
from dem.phases.arrange import chain_of
from dem.scene.reading import scene_hash
from dem.scene.scene import Scene

W, L, T1, BARB, BODY, RHO = 0.0467, 0.042, 0.021, 0.0095, 0.0213, 1250.0
THICK = "smarticle.middle_thickness_in_plane_m"


def robot(body: float | None = BODY, angles: tuple[float, float] = (90.0, 90.0), barb: float = L) -> Boxes:
    return Boxes(
        middle_length=W,
        barb_length=barb,
        thickness_normal=T1,
        thickness_in_plane=BARB,
        density=RHO,
        angles=(math.radians(angles[0]), math.radians(angles[1])),
        middle_thickness_in_plane=body,
    )


def with_spheres(boxes: Boxes, *, rows: int = 1, diameter: float = BARB, pitch: float = 0.2) -> Particle:
    return Particle(boxes, SphereChain(rows=rows, diameter=diameter, pitch=pitch * diameter))


def test_mass_centre_and_inertia_are_those_of_three_boxes_written_out() -> None:
    boxes = robot()
    middle, barb = RHO * W * BODY * T1, RHO * L * BARB * T1
    mass = middle + 2 * barb
    y = 2 * barb * (L / 2) / mass  # centre of mass above the middle link
    along_x = middle * (T1**2 + BODY**2) / 12 + middle * y**2
    along_x += 2 * (barb * (L**2 + T1**2) / 12 + barb * (L / 2 - y) ** 2)
    along_y = middle * (W**2 + T1**2) / 12 + 2 * (barb * (T1**2 + BARB**2) / 12 + barb * (W / 2) ** 2)
    along_z = middle * (W**2 + BODY**2) / 12 + middle * y**2
    along_z += 2 * (barb * (L**2 + BARB**2) / 12 + barb * ((W / 2) ** 2 + (L / 2 - y) ** 2))
    assert boxes.volume == pytest.approx(mass / RHO, rel=1e-13)
    assert boxes.mass == pytest.approx(mass, rel=1e-13)
    assert boxes.link_masses == pytest.approx([barb, middle, barb], rel=1e-13)
    assert boxes.inertia == pytest.approx([along_x, along_y, along_z], rel=1e-12)
    assert boxes.vertices[:, 1] == pytest.approx([L - y, -y, -y, L - y], rel=1e-12)
    own = np.array([[T1**2 + t**2, length**2 + T1**2, length**2 + t**2] for length, t in ((L, BARB), (W, BODY))]) / 12
    assert boxes.link_inertias == pytest.approx(np.array([barb * own[0], middle * own[1], barb * own[0]]), rel=1e-12)


@given(st.floats(-15, 105), st.floats(-15, 105))
def test_inertia_of_a_bent_one_is_the_sum_of_its_links(a1: float, a2: float) -> None:
    boxes = robot(angles=(a1, a2))
    centre = boxes.link_masses @ boxes.link_centres / boxes.mass
    assert centre == pytest.approx(np.zeros(3), abs=1e-15)
    tensor = np.zeros((3, 3))
    for mass, moments, turn, arm in zip(
        boxes.link_masses, boxes.link_inertias, boxes.link_rotations, boxes.link_centres, strict=True
    ):
        tensor += turn @ np.diag(moments) @ turn.T + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    assert tensor == pytest.approx(np.diag(boxes.inertia), abs=1e-12 * tensor.max())


def test_links_of_one_thickness_are_what_they_were_bit_by_bit() -> None:
    plain, same = with_spheres(robot(None, (80.0, 95.0))), with_spheres(robot(BARB, (80.0, 95.0)))
    for name in ("mass", "volume", "inertia", "link_masses", "link_inertias", "vertices", "link_centres"):
        assert np.array_equal(getattr(plain.boxes, name), getattr(same.boxes, name)), name
    for name in ("centres", "links", "local_centres", "reach", "smallest_effective_mass"):
        assert np.array_equal(getattr(plain, name), getattr(same, name)), name
    # Of the commit before there was the key.
    assert (plain.boxes.mass, plain.boxes.volume) == (0.032593312500000006, 2.6074650000000003e-05)
    assert plain.boxes.inertia.tolist() == [7.482787224803269e-06, 1.5975258918851717e-05, 2.106243767490498e-05]
    middle = [5.1556982421875e-07, 2.5445032779687498e-06, 2.2041058834374998e-06]
    assert plain.boxes.link_inertias[1].tolist() == middle
    # The effective mass is a quotient of sums, whose last digit depends on their order.
    assert (plain.reach, plain.smallest_effective_mass) == pytest.approx(
        (0.05174733231152774, 0.0069146250657298675), rel=1e-14
    )


def test_a_scene_without_the_key_has_the_hash_that_it_had() -> None:
    scene = chain()
    assert scene_hash(scene) == "3d9fae0cfefceb25da2d0d95efc7d26cf9ffcd60ad59af0e58d9221b2b65839c"
    # An eigenvalue of LAPACK, whose last digit depends on the processor.
    assert YadeKind().stable_step(scene, articulated=True) == pytest.approx(0.00011896777217813631, rel=1e-12)
    assert scene_hash(chain({THICK: 0.021})) != scene_hash(scene)


@pytest.mark.parametrize("body", [0.0096, 0.0142, 0.0190, 0.0213, 0.0233])
@pytest.mark.parametrize("rows", [1, 2])
def test_spheres_fill_the_body_from_face_to_face(body: float, rows: int) -> None:
    d = BARB
    particle = with_spheres(robot(body), rows=rows, diameter=d)
    plain = with_spheres(robot(None), rows=rows, diameter=d)
    own = particle.centres[particle.links == 1] - (particle.boxes.vertices[1] + particle.boxes.vertices[2]) / 2
    across = np.unique(own[:, 1].round(12))
    # Spheres as thick as barbs: their surfaces are the faces, and nothing as thick fits between two rows.
    assert across[-1] + d / 2 == pytest.approx(body / 2, rel=1e-9)
    assert across[0] - d / 2 == pytest.approx(-body / 2, rel=1e-9)
    assert np.abs(across).min() < 1e-12  # on the hinges' axis, where motors sit
    assert np.diff(across).max() <= d * (1 + 1e-9)
    # Every row is the chain of the plain one, from hinge to hinge, and as high.
    assert len(own) == len(across) * (plain.links == 1).sum()
    assert own[:, 0].min() == pytest.approx(-W / 2)
    assert own[:, 0].max() == pytest.approx(W / 2)
    assert len(np.unique(own[:, 2].round(12))) == rows
    assert particle.reach >= np.linalg.norm(particle.centres, axis=1).max() + d / 2


@pytest.mark.parametrize("diameter", [0.006, 0.0095, 0.012])
def test_spheres_of_any_size_keep_the_mean_width_of_the_section(diameter: float) -> None:
    particle = with_spheres(robot(), diameter=diameter)
    y = particle.local_centres[particle.links == 1, 1]
    # What the rows sweep is a stadium, whose mean width is its perimeter over π.
    swept = (math.pi * diameter + 2 * np.ptp(y)) / math.pi
    assert swept - diameter == pytest.approx(mean_width(T1, BODY) - mean_width(T1, BARB), rel=1e-9)


@given(
    a1=st.floats(-15, 105),
    a2=st.floats(-15, 105),
    body=st.floats(0.00951, 0.0233),
    diameter=st.sampled_from([0.006, 0.0095]),
    pitch=st.sampled_from([0.1, 0.5, 1.0]),
)
def test_barbs_turn_freely_beside_the_body(a1: float, a2: float, body: float, diameter: float, pitch: float) -> None:
    particle = with_spheres(robot(body, (a1, a2)), diameter=diameter, pitch=pitch)
    middle = particle.centres[particle.links == 1]
    for barb in (0, 2):
        own = particle.centres[particle.links == barb]
        apart = np.linalg.norm(own[:, None] - middle[None], axis=-1).min()
        assert apart >= diameter * (1 + 1e-9)
        # Tips are where they were, and nothing of a barb that stands out of the body at a right angle is left out.
        tip = particle.boxes.vertices[0 if barb == 0 else 3]
        assert np.linalg.norm(own - tip, axis=1).min() == pytest.approx(diameter / 2)
    assert particle.barb_start - diameter / 2 < particle.boxes.bulge + 0.6 * diameter + 0.04 * particle.boxes.bulge


def rest(scene: Scene) -> State:
    poses = chain_of(scene).poses()
    still = np.zeros_like(poses.positions)
    rotations = np.array([rotation.as_matrix() for rotation in poses.rotations])
    return State.rigid(scene.particle.boxes, poses.positions, rotations, still, still)


def test_the_chain_is_as_wide_as_two_bodies_and_hooked_a_gap_apart() -> None:
    scene = chain({THICK: 0.021})
    layout, state, d = chain_of(scene), rest(scene), scene.sphere_diameter
    spheres = state.spheres(scene.particle)
    # Barb, gap and half a body from row to row, and half a body beyond each.
    assert layout.width == pytest.approx(0.0467 + 0.00105 + 1.5 * 0.021)
    assert np.ptp(spheres[..., 1]) + d == pytest.approx(layout.width)
    assert extent(state, d) == pytest.approx(layout.width)
    for k in range(5):
        apart = np.linalg.norm(spheres[k][:, None] - spheres[k + 1][None], axis=-1).min()
        # The nearest spheres need not face each other.
        assert apart == pytest.approx(d + layout.gap, rel=1e-3)
        # Tips stand a gap before the other's body.
        facing = state.vertices[k, 0, 1] if k % 2 == 0 else state.vertices[k, 3, 1]
        body = state.vertices[k + 1, 1, 1] + math.copysign(0.0105, facing - state.vertices[k + 1, 1, 1])
        assert abs(facing - body) == pytest.approx(layout.gap)
    assert state.positions.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    ends = [
        state.link_positions[tie.smarticle, tie.link] + tie.along * state.link_rotations[tie.smarticle, tie.link][:, 0]
        for tie in layout.ties("axis")
    ]
    assert ends[0][1] == pytest.approx(0, abs=1e-12)
    assert ends[1][0] - ends[0][0] == pytest.approx(layout.length)


@pytest.mark.parametrize("turn", [0.3, -0.7, math.pi / 2])
def test_width_and_parting_know_the_bodies_corners(turn: float) -> None:
    # Where bodies are turned, their corners stick out, and tips on the other side.
    particle = with_spheres(robot(0.0195))
    one = np.array([[-W / 2, L], [W / 2, L], *([x, y] for x in (-W / 2, W / 2) for y in (-0.005, 0.0, 0.005))])
    one = one @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    assert one[:2, 1].min() > one[:, 1].min()  # or the corners would not matter
    turned = Rotation.from_rotvec([0, 0, turn]).as_matrix()[None]
    d, still = BARB, np.zeros((1, 3))
    state = State.rigid(particle.boxes, still, turned, still, still)
    assert extent(state, d) == pytest.approx(np.ptp(one[:, 1]) + d)
    length = np.ptp(one[:, 0]) + d
    for shift, expected in ((-1e-9, False), (1e-9, True)):
        places = np.array([[0.0, 0.0, 0.0], [length + shift, 0.0, 0.0]])
        pair = State.rigid(particle.boxes, places, np.repeat(turned, 2, axis=0), 0 * places, 0 * places)
        assert parted(pair, d) is expected
