"""Start poses from a file: what a scene checks before a run, its hash, and the copy in the run directory."""

import itertools
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scenes import SMALL, changed

from dem.errors import InputError
from dem.phases.place import MOST_OVERLAP
from dem.plan.outlook import warnings_of
from dem.scene.reading import dump_scene, load_scene, parse_scene, scene_hash
from dem.scene.scene import Scene

D = 0.001
ROD = {"shape": "rod", "length_m": 0.01, "diameter_m": D}
SCENE: dict[str, Any] = {
    "engine": "links",
    "count": 2,
    "particle": ROD,
    "container": {"radius_m": 0.02, "height_m": 0.03},
    "phases": [{"type": "place", "file": "poses.csv"}, {"type": "relax", "duration_s": 0.1}],
}
HOOKS = {"upper_height_m": 0.01, "lower_height_m": 0.002, "length_m": 0.02}
RODS = [[(-5, 0, 5), (5, 0, 5)], [(-5, 2, 5), (5, 2, 5)]]


def write(folder: Path, bodies: Any, extra: str = "") -> Path:
    """A file of bodies, each a list of points [mm]; `extra`: column and value, equal for all."""
    column, _, value = extra.partition("=")
    rows = [
        ",".join([str(k), *([value] if extra else []), *map(repr, map(float, point))])
        for k, body in enumerate(bodies)
        for point in body
    ]
    path = folder / "poses.csv"
    path.write_text("\n".join([f"body,{column + ',' if extra else ''}x [mm],y [mm],z [mm]", *rows]) + "\n")
    return path


def scene(folder: Path, **changes: Any) -> Scene:
    return parse_scene(changed({**SMALL, **SCENE}, changes), source="scene.yaml", folder=folder)


def refused(folder: Path, **changes: Any) -> str:
    with pytest.raises(InputError) as raised:
        scene(folder, **changes)
    text = str(raised.value)
    assert "\n" not in text
    return text.removeprefix("scene.yaml: ")


def moved(by: tuple[float, float, float]) -> Any:
    return [RODS[0], (np.array(RODS[1]) + by).tolist()]


def test_bodies_that_barely_overlap_are_accepted(tmp_path: Path) -> None:
    for depth in (-0.5, 0.0, 0.9 * MOST_OVERLAP):
        write(tmp_path, moved((0, -1 - depth, 0)))
        assert scene(tmp_path).phases[0].kind == "place"


def test_strands_of_twisted_bars_count_where_they_meet(tmp_path: Path) -> None:
    # At its joints with the crown a leg has two strands, 1.25 mm to both sides of its axis, where only the crown has
    # spheres. The legs lean by 50°, so that one of these strands is the lowest point.
    staple = {"shape": "staple", "crown_m": 0.012, "leg_m": 0.006, "twist_deg": 90}
    flat = staple | {"thickness_normal_m": 3e-3, "thickness_in_plane_m": 0.5e-3}
    lean = np.radians(50)
    below = 1.25 * np.sin(lean) + 0.25
    for depth in (-0.01, 0.1):
        leg, height = 6 * np.array([0, -np.sin(lean), np.cos(lean)]), below - depth
        joints = np.array([[-6, 0, height], [6, 0, height]])
        write(tmp_path, [[joints[0] + leg, *joints, joints[1] + leg]])
        changes = {"particle": flat, "count": 1, "fidelity": "standard"}
        if depth < 0:
            assert scene(tmp_path, **changes).count == 1
        else:
            assert "reaches 0.1 mm below the floor" in refused(tmp_path, **changes)


@pytest.mark.parametrize(
    ("bodies", "changes", "message"),
    [
        (moved((0, -1.2, 0)), {}, "phases.0.file: body 0 (line 2) overlaps body 1 (line 4) by 0.2 mm at "),
        (moved((0, 0, -4.7)), {}, "phases.0.file: body 1 (line 4) of phases.0.file reaches 0.2 mm below the floor"),
        (moved((0, 0, 25)), {}, "container.height_m: body 1 (line 4) of phases.0.file reaches 0.5 mm above the wall"),
        (moved((16, 0, 0)), {}, "container.radius_m: body 1 (line 4) of phases.0.file reaches 1.1 mm out of the wall"),
        (moved((0, 5, 0)), {"hooks": HOOKS}, None),
        (
            moved((0, 5, 5)),
            {"hooks": HOOKS},
            "hooks.upper_height_m: body 1 (line 4) of phases.0.file reaches 1 mm into this hook",
        ),
        (RODS[:1], {}, "phases.0.file: poses.csv has 1 bodies, but count is 2; make them equal"),
        (
            RODS,
            {"particle.length_m": 0.012},
            "phases.0.file: poses.csv, body 0 (line 2): its points are up to 1 mm off",
        ),
        (RODS, {"phases.0.unit": "m"}, "has the units m and mm"),
        (RODS, {"engine": "yade"}, "phases.0 (place): start poses from a file: only engine: links computes that"),
        (RODS, {"phases.1": {"type": "deposit"}}, "a run starts with one 'deposit', 'place' or 'take-over'"),
        (RODS, {"phases.0.file": "absent.csv"}, "absent.csv cannot be read (No such file or directory)"),
        (RODS, {"phases.0.sha256": "f" * 64}, "has other content than when the scene was made"),
        (RODS, {"phases.0.sha256": "f" * 64}, "phases.0.sha256: /"),
        (RODS, {"phases.0.file": ".", "phases.0.sha256": "f" * 64}, "phases.0.file: /"),
        (RODS, {"phases.0.file": ""}, "phases.0.file: '' is "),
        (RODS, {"particle": [ROD, ROD]}, "poses.csv, body 0 (line 2): kind is None; particle has several shapes"),
    ],
)
def test_what_cannot_be_is_rejected_before_a_run(
    bodies: Any, changes: dict[str, Any], message: str | None, tmp_path: Path
) -> None:
    write(tmp_path, bodies)
    if message is None:
        assert scene(tmp_path, **changes)
    else:
        assert message in refused(tmp_path, **changes)


def test_a_worm_may_not_run_through_itself(tmp_path: Path) -> None:
    worm = {"shape": "filament", "length_m": 0.024, "diameter_m": D, "segments": 12, "young_modulus_Pa": 5e4}
    angles = np.radians([0, 45, 90, 135, 180, 225, 270, 315, 360, 405, 450])
    loop = np.cumsum([(-6, 0, 5), *(2 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)), (0, 2, 0)], 0)
    write(tmp_path, [loop])
    assert "phases.0.file: body 0 (line 2) overlaps itself by " in refused(tmp_path, particle=worm, count=1)
    # Its turns are beside each other.
    side = np.linalg.norm(np.diff(loop, axis=0), axis=1).max() * 0.15
    raised = loop + np.outer(np.arange(13), [0, 0, side])
    shorter = raised[0] + (raised - raised[0]) * (2 / np.linalg.norm(raised[1] - raised[0]))
    write(tmp_path, [shorter])
    assert scene(tmp_path, particle=worm, count=1)


def test_kinds_are_those_of_the_file(tmp_path: Path) -> None:
    short = {**ROD, "length_m": 0.006}
    bodies = [RODS[0], [(-3, 2, 5), (3, 2, 5)]]
    path = write(tmp_path, bodies)
    lines = path.read_text().replace("body,", "body,kind,").replace("\n0,", "\n0,1,").replace("\n1,", "\n1,0,")
    path.write_text(lines)
    made = scene(tmp_path, particle=[short, ROD])
    poses = made.phases[0]._poses(made)  # type: ignore[union-attr]
    assert poses.kinds is not None
    assert poses.kinds.tolist() == [1, 0]
    path.write_text(lines + "".join(f"2,1,{x},4,5\n" for x in (-5, 5)))
    message = "poses.csv has 1 bodies of kind 0, the scene 2 by count or share of its particle; make them equal"
    assert message in refused(tmp_path, count=3, particle=[{**short, "count": 2}, ROD | {"count": 1}])


def test_the_hash_is_that_of_the_content(tmp_path: Path) -> None:
    path = write(tmp_path, RODS)
    made = scene(tmp_path)
    copied = shutil.copy(path, tmp_path / "other.csv")
    assert scene_hash(scene(tmp_path, **{"phases.0.file": Path(copied).name})) == scene_hash(made)
    write(tmp_path, moved((0, 1, 0)))
    assert scene_hash(scene(tmp_path)) != scene_hash(made)
    # The file has changed since the first scene was made.
    with pytest.raises(InputError, match=r"phases\.0\.sha256: .* has other content than when"):
        made.phases[0].ready(made)


def test_a_scene_of_a_run_directory_names_the_copy_in_it(tmp_path: Path) -> None:
    out = tmp_path / "runs" / "a"
    out.mkdir(parents=True)
    write(tmp_path, RODS)
    made = scene(tmp_path)
    there = yaml.safe_load(dump_scene(made, out))["phases"][0]
    assert there["file"] == "../../poses.csv"
    (out / "scene.yaml").write_text(dump_scene(made, out, attached=True))
    name, content = made.phases[0].attached  # type: ignore[misc]
    (out / name).write_bytes(content)
    (tmp_path / "poses.csv").unlink()
    again = load_scene(out / "scene.yaml")
    assert scene_hash(again) == scene_hash(made)
    again.phases[0].ready(again)
    # Without its file a scene can still be read, such as for measures, but not run.
    (out / name).unlink()
    gone = load_scene(out / "scene.yaml")
    with pytest.raises(InputError, match=r"phases\.0\.file: .*poses\.csv cannot be read"):
        gone.phases[0].ready(gone)


def test_flat_straight_bodies_of_several_strands_are_not_determined(tmp_path: Path) -> None:
    flat = {"shape": "rod", "length_m": 0.01, "thickness_normal_m": 0.003, "thickness_in_plane_m": 0.001}
    write(tmp_path, moved((0, 5, 0)))
    assert scene(tmp_path, particle=flat, **{"fidelity": {"base": "draft", "rows": 1}})
    message = "centre lines leave open how a straight body of several strands is turned about its length"
    assert re.search(message, refused(tmp_path, particle=flat, fidelity={"base": "draft", "rows": 2}))


def test_bodies_whose_links_may_be_turned_about_their_length_are_not_determined(tmp_path: Path) -> None:
    write(tmp_path, moved((0, 5, 0)))
    worm = {"shape": "filament", "length_m": 0.01, "segments": 5, "diameter_m": 1e-3, "young_modulus_Pa": 1e5}
    assert "in which plane a filament prefers" in refused(tmp_path, particle={**worm, "curvature_per_m": 60})
    for joints in (
        {"law": "elastic", "axes": 3, "stiffness_N_m_per_rad": 1e-3, "rest_angle_deg": [30, 20, 40]},
        {
            "law": "motor",
            "axes": 3,
            "stiffness_N_m_per_rad": 1e-3,
            "torque_limit_N_m": 1e-3,
            "poured_deg": [30, 20, 40],
        },
    ):
        chain = {"shape": "chain", "links": 2, "link_m": 0.005, "diameter_m": 1e-3, "joints": joints}
        assert "how links are turned about their length" in refused(tmp_path, particle=chain)


def test_a_shake_without_gravity_would_not_move(tmp_path: Path) -> None:
    write(tmp_path, moved((0, 5, 0)))
    phases = [SCENE["phases"][0], {"type": "shake", "duration_s": 0.1, "frequency_hz": 40, "peak_acceleration_g": 3}]
    assert scene(tmp_path, phases=phases)
    assert refused(tmp_path, phases=phases, gravity_m_per_s2=0.0).startswith(
        "phases.1.peak_acceleration_g: Γ = 3 is in"
    )


def test_closed_bodies_that_are_linked_are_accepted_and_named(tmp_path: Path) -> None:
    square = np.array([[5, 5, 0], [-5, 5, 0], [-5, -5, 0], [5, -5, 0], [5, 5, 0]])
    ring = {
        "shape": "segments",
        "points_m": (1e-3 * square[:4]).tolist(),
        "pairs": [[k, (k + 1) % 4] for k in range(4)],
        "diameter_m": D,
    }
    upright = square[:, [0, 2, 1]] + np.array([5, 0, 0])
    for apart, number in ((0, 1), (20, 0)):
        bars = [list(itertools.pairwise(points)) for points in (square, upright + np.array([apart, 0, 0]))]
        rows = [
            f"{body},{bar},{x},{y},{z + 10}"
            for body, own in enumerate(bars)
            for bar, ends in enumerate(own)
            for x, y, z in ends
        ]
        (tmp_path / "poses.csv").write_text("body,bar,x [mm],y [mm],z [mm]\n" + "\n".join(rows) + "\n")
        found = scene(tmp_path, particle=ring, **{"container.radius_m": 0.04, "count": 2})
        warned = [text for text in warnings_of(found) if "linked" in text]
        assert len(warned) == number
        assert all(text.startswith("phases.0.file") for text in warned)
