"""Bodies at given bars: what is laid out by a known pose is found again, and what does not fit is rejected."""

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.kinds import Kind
from dem.body.linkage import Joint
from dem.body.particle import Particle
from dem.body.posing import posed
from dem.errors import InputError

TURN = Rotation.from_rotvec([0.7, -1.1, 2.0])
PLACE = np.array([0.01, -0.02, 0.03])
SHAPES: dict[str, dict[str, Any]] = {
    "staple": {"shape": "staple", "crown_m": 0.014, "leg_m": [0.005, 0.007], "diameter_m": 0.0005},
    "tripod": {"shape": "star", "arms": 3, "arm_m": 0.006, "diameter_m": 0.001},
    "ring": {"shape": "ring", "radius_m": 0.005, "segments": 8, "diameter_m": 0.0005},
    "rod": {"shape": "rod", "length_m": 0.02, "diameter_m": 0.001},
}
WORM = {"shape": "filament", "length_m": 0.03, "diameter_m": 8e-4, "segments": 12, "young_modulus_Pa": 5e4}
LINKS: dict[str, Any] = {"shape": "chain", "link_m": [0.006, 0.005, 0.005, 0.004], "diameter_m": 0.001}


def body_of(particle: dict[str, Any] | None) -> Particle | Kind:
    return small({"engine": "links"} | ({} if particle is None else {"particle": particle})).bodies[0]


def turned(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(TURN.apply(points.reshape(-1, 3)).reshape(points.shape) + PLACE)


@pytest.mark.parametrize("name", ["smarticle", *SHAPES])
def test_a_rigid_body_is_found_where_it_was_put(name: str) -> None:
    body = body_of(SHAPES.get(name))
    if isinstance(body, Kind):
        segments = body.bars.ends
    else:
        segments = np.stack([body.boxes.vertices[:-1], body.boxes.vertices[1:]], axis=1)
    pose = posed(body, turned(segments))
    np.testing.assert_allclose(pose.position, PLACE, atol=1e-12)
    np.testing.assert_allclose(segments @ pose.turn.T + pose.position, turned(segments), atol=1e-12)
    if name != "rod":  # which may be turned about its length
        np.testing.assert_allclose(pose.turn, TURN.as_matrix(), atol=1e-9)
    assert pose.bent is None


def test_points_in_a_row_are_a_staple_though_its_legs_begin_at_the_crown() -> None:
    crown, (first, second) = 0.014, (0.005, 0.007)
    points = np.array([(-crown / 2, first, 0), (-crown / 2, 0, 0), (crown / 2, 0, 0), (crown / 2, second, 0)])
    points = turned(points)
    body = body_of(SHAPES["staple"])
    assert isinstance(body, Kind)
    pose = posed(body, np.stack([points[:-1], points[1:]], axis=1))
    placed = body.bars.ends @ pose.turn.T + pose.position
    np.testing.assert_allclose(placed, [points[[1, 0]], points[[1, 2]], points[[2, 3]]], atol=1e-12)


@pytest.mark.parametrize("reversed_bars", [[], [0], [1, 2], [0, 1, 2]])
def test_bars_of_a_star_may_be_given_from_either_end(reversed_bars: list[int]) -> None:
    body = body_of(SHAPES["tripod"])
    assert isinstance(body, Kind)
    segments = turned(body.bars.ends)
    segments[reversed_bars] = segments[reversed_bars, ::-1]
    pose = posed(body, segments)
    np.testing.assert_allclose(pose.turn, TURN.as_matrix(), atol=1e-9)


def helix(count: int, step: float) -> NDArray[np.float64]:
    """Points in space at equal distances along a helix."""
    turns = 0.5 * np.arange(count)
    edges = np.stack([np.cos(turns), np.sin(turns), np.full(count, 0.4)], axis=1)
    edges *= step / np.linalg.norm(edges, axis=1)[:, None]
    return np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])


def test_a_filament_has_its_nodes_and_its_centre_of_mass() -> None:
    points = turned(helix(12, 0.0025))
    pose = posed(body_of(WORM), np.stack([points[:-1], points[1:]], axis=1))
    assert pose.bent is not None
    np.testing.assert_allclose(pose.bent.points, points)
    np.testing.assert_allclose(pose.position, (points[1:] + points[:-1]).mean(axis=0) / 2, atol=1e-15)


AXES: dict[str, tuple[Any, list[list[float]]]] = {
    "hinges": (1, [[0.5], [-0.9], [0.3]]),
    "straight hinges": (1, [[0.0], [0.0], [0.0]]),
    "tilted hinges": ([[0, 1, 1]], [[0.5], [-0.9], [0.3]]),
    "two axes": (2, [[0.5, 0.2], [-0.9, -0.7], [0.3, 1.0]]),
    "other two axes": ([[0, 1, 0], [0, 0, 1]], [[0.5, 0.2], [-0.9, -0.7], [0.3, 1.0]]),
    "any axis": (3, [[0.5, 0.2, 0.0], [-0.9, -0.7, 0.0], [0.3, 1.0, 0.0]]),
}


def rotation(joint: Joint, angles: list[float]) -> NDArray[np.float64]:
    """Rotation from the frame of the link after to that of the link before."""
    if len(joint.axes) == 3:
        return np.asarray(Rotation.from_rotvec(np.array(angles) @ np.array(joint.axes)).as_matrix())
    found = np.eye(3)
    for axis, angle in zip(joint.axes, angles, strict=True):
        found = found @ Rotation.from_rotvec(angle * np.array(axis)).as_matrix()
    return found


@pytest.mark.parametrize("name", AXES)
def test_links_have_frames_that_their_joints_allow(name: str) -> None:
    axes, angles = AXES[name]
    body = body_of({**LINKS, "joints": {"law": "free", "axes": axes}})
    assert isinstance(body, Kind)
    assert body.linkage is not None
    frames = [TURN.as_matrix()]
    for joint, own in zip(body.linkage.joints, angles, strict=True):
        frames.append(frames[-1] @ rotation(joint, own))
    edges = np.array([length * frame[:, 0] for length, frame in zip(body.bars.lengths, frames, strict=True)])
    points = PLACE + np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])
    pose = posed(body, np.stack([points[:-1], points[1:]], axis=1))
    bent = pose.bent
    assert bent is not None
    assert bent.turns is not None
    assert bent.angles is not None
    np.testing.assert_allclose(bent.points, (points[1:] + points[:-1]) / 2)
    np.testing.assert_allclose(bent.turns[:, :, 0] * body.bars.lengths[:, None], edges, atol=1e-9)
    for k, joint in enumerate(body.linkage.joints):
        allowed = rotation(joint, bent.angles[k, : len(joint.axes)].tolist())
        np.testing.assert_allclose(bent.turns[k].T @ bent.turns[k + 1], allowed, atol=1e-7)
    assert np.abs(bent.angles).max() < 1.3  # not the long way round
    if name == "hinges":  # whose axes are where the links bend, up to the sign of all
        np.testing.assert_allclose(np.abs(bent.angles[:, 0]), [0.5, 0.9, 0.3], atol=1e-6)


def bent_worm(**changes: float) -> NDArray[np.float64]:
    points = helix(12, changes.get("step", 0.0025))
    if "back" in changes:
        points = np.stack([0.0025 * (np.arange(13) % 2), np.zeros(13), np.zeros(13)], axis=1)
    return np.stack([points[:-1], points[1:]], axis=1)


@pytest.mark.parametrize(
    ("particle", "segments", "message"),
    [
        (WORM, bent_worm()[1:], "11 bars, but a filament has 12; give 13 points in a row"),
        (SHAPES["tripod"], bent_worm()[:2], "2 bars, but a star has 3; give each bar by two points, with a column bar"),
        (WORM, bent_worm(step=0.0026), " is 2.6 mm long, that of the scene 2.5 mm; correct points or scene"),
        (WORM, bent_worm(back=1), "it turns by 180° at point 1; at most 150° are possible"),
        (WORM, bent_worm()[::-1], "bars 0 and 1 are"),
        (SHAPES["rod"], bent_worm()[:1], "bar 0 is 2.5 mm long, that of the scene 20 mm"),
        (None, bent_worm()[:3] * 4, "its points are up to "),
        (SHAPES["rod"], bent_worm()[:1] * 0, "its points are up to 10 mm off the rod"),
        (
            {**LINKS, "link_m": 0.0025, "links": 12, "joints": {"law": "free"}},
            bent_worm(),
            "about what is none of its axes; give points that its joints can reach",
        ),
    ],
)
def test_what_does_not_fit_is_rejected(
    particle: dict[str, Any] | None, segments: NDArray[np.float64], message: str
) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        posed(body_of(particle), segments)


def test_right_lengths_at_other_angles_are_told_apart() -> None:
    body = body_of(SHAPES["staple"])
    assert isinstance(body, Kind)
    segments = body.bars.ends.copy()
    segments[0, 0] = segments[0, 1] + (segments[0, 1] - segments[0, 0])  # a leg to the other side
    with pytest.raises(InputError, match="have the right lengths but stand at other angles"):
        posed(body, segments)
