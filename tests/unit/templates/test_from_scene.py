"""Sweeps over keys of a scene from Python: values, names of values, what changes together, names of runs."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dem.errors import InputError
from dem.scene.scene import Scene
from smarticles.public import write_sweep
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep

ROD, RING = {"shape": "rod", "length_m": 0.02}, {"shape": "ring", "radius_m": 0.005}
SCENE = Scene(seed=1, count=5, fidelity="draft", phases=[{"type": "deposit"}])


def points(folder: Path, vary: Any, together: Any = None, scene: Scene = SCENE) -> list[Point]:
    return expand(load_sweep(write_sweep(scene, vary, folder, together or {})))


@pytest.mark.parametrize(
    "values", [[4, 5], (4, 5), range(4, 6), np.arange(4, 6), [np.int64(4), np.int32(5)], pd.Series([4, 5])]
)
def test_values_are_any_sequence_of_numbers(tmp_path: Path, values: Any) -> None:
    found = points(tmp_path, {"count": values, "seed": values})
    assert [(point.scene.count, point.scene.seed) for point in found] == [(4, 4), (4, 5), (5, 4), (5, 5)]
    assert [point.name for point in found][:2] == ["count4_seed4", "count4_seed5"]


def test_names_of_runs_have_the_digits_that_tell_them_apart(tmp_path: Path) -> None:
    found = points(tmp_path, {"smarticle.aspect_ratio": np.linspace(0, 1, 4)})
    assert [point.name[12:] for point in found] == ["0", "0.333", "0.667", "1"]
    assert found[1].scene.smarticle.aspect_ratio == 1 / 3
    near = points(tmp_path, {"smarticle.aspect_ratio": [0.5, 0.5 + 1e-7, 0.6]})
    assert [point.name[12:] for point in near] == ["0.5", "0.5000001", "0.6"]
    # Names of earlier sweeps stay, so that these can be continued.
    short = points(tmp_path, {"smarticle.aspect_ratio": [1.0, 0.4567]})
    assert [point.name[12:] for point in short] == ["1.0", "0.4567"]


def test_keys_in_zip_change_together_and_are_crossed_with_others(tmp_path: Path) -> None:
    together = {"count": [4, 5], "container.radius_m": np.array([0.02, 0.03])}
    found = points(tmp_path, {"seed": [1, 2]}, together)
    assert [(p.scene.count, p.scene.container.radius_m, p.scene.seed) for p in found] == [
        (4, 0.02, 1), (4, 0.02, 2), (5, 0.03, 1), (5, 0.03, 2),
    ]  # fmt: skip
    assert found[0].name == "count4_radius_m0.02_seed1"
    assert len(points(tmp_path, {}, together)) == 2


def test_parts_of_a_scene_are_values_with_names(tmp_path: Path) -> None:
    shapes = {"rods": ROD, "mixed": [{**ROD, "share": 3}, RING], "smarticles": "smarticle"}
    found = points(tmp_path, {"particle": shapes, "seed": [1, 2]})
    assert [point.name for point in found] == [f"{name}_seed{seed}" for name in shapes for seed in (1, 2)]
    assert [point.values["particle"] for point in found[::2]] == list(shapes)
    assert [point.scene for point in found[::2]] == [SCENE.replace(particle=shape) for shape in shapes.values()]
    relax = {"type": "relax", "duration_s": 0.25}
    phases = points(tmp_path, {"phases": {"pour": SCENE.phases, "rest": [*SCENE.given["phases"], relax]}})
    assert [[phase.kind for phase in point.scene.phases] for point in phases] == [["deposit"], ["deposit", "relax"]]
    named = points(tmp_path, {}, {"gravity_m_per_s2": {"moon": 1.6, "earth": 9.81}, "count": [4, 5]})
    assert [(p.name, p.scene.gravity_m_per_s2) for p in named] == [("moon_count4", 1.6), ("earth_count5", 9.81)]


def test_the_only_particle_needs_no_number(tmp_path: Path) -> None:
    rods = Scene(seed=1, count=5, fidelity="draft", phases=[{"type": "deposit"}], particle=ROD)
    found = points(tmp_path, {"particle.length_m": [0.01, 0.015]}, scene=rods)
    assert [point.scene.model_dump()["particle"][0]["length_m"] for point in found] == [0.01, 0.015]
    two = Scene(seed=1, count=6, fidelity="draft", phases=[{"type": "deposit"}], particle=[ROD, RING])
    with pytest.raises(InputError, match=r"as in particle\.0\.length_m"):
        points(tmp_path, {"particle.length_m": [0.01, 0.015]}, scene=two)


def test_text_in_a_named_value_is_no_template(tmp_path: Path) -> None:
    name = 'it\'s "{{ 7 * 7 }}" \\ {% raw %} μ'
    assert [point.scene.name for point in points(tmp_path, {"name": {"odd": name}})] == [name]


def test_lists_of_numbers_need_no_names(tmp_path: Path) -> None:
    found = points(tmp_path, {"smarticle.angles_deg": [[90, 90], [80, 85]]})
    assert [point.name for point in found] == ["angles_deg90_90", "angles_deg80_85"]


def test_a_share_may_be_0(tmp_path: Path) -> None:
    mixture = SCENE.replace(particle=[{**ROD, "share": 1}, {**RING, "share": 1}])
    found = points(tmp_path, {"particle.0.share": [0, 0.25, 1]}, scene=mixture)
    kinds = [[kind.name for kind in point.scene.mixture.kinds] for point in found]  # type: ignore[union-attr]
    assert kinds == [["ring"], ["rod", "ring"], ["rod", "ring"]]


def test_paths_in_values_start_at_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rough.yaml").write_text("friction_wall: 0.9\n")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    for path in ("rough.yaml", Path("rough.yaml")):
        found = points(tmp_path / "out", {"contact.preset": {"rough": path}})
        assert [point.scene.contact.friction_wall for point in found] == [0.9]


@pytest.mark.parametrize(("vary", "together", "message"), [
    ({"seed": 3}, {}, r"vary: seed: 3 is one value; give a list of values, e\.g\. \[3\]"),
    ({"count": np.int64(3)}, {}, r"vary: count: 3 is one value"),
    ({"engine": "links"}, {}, r"vary: engine: 'links' is one value; .* \['links'\]"),
    ([1, 2], {}, r"vary: \[1, 2\] is no mapping; give values by key"),
    ({"count": {4, 5}}, {}, r"vary: count: \{4, 5\} has no order; give a list"),
    ({"count": []}, {}, r"vary: count: has no values; give one at least"),
    ({"count": [object]}, {}, r"vary: count: .* is of type type; give numbers, text, lists"),
    ({"gravity_m_per_s2": [float("inf")]}, {}, r"vary: gravity_m_per_s2: inf is not a finite number"),
    ({"particle": [ROD, RING]}, {}, r"vary: particle: .* give values with names, \{'particle': \{'NAME': VALUE"),
    ({"name": ["a b"]}, {}, r"vary: name: 'a b' cannot be part of the name of a run; give values with names"),
    ({"count": {"a b": 4}}, {}, r"vary: count: 'a b' cannot name a value; use letters, digits"),
    ({"seed": {"one": 1}}, {}, r"vary: seed: seeds have no names; give a list"),
    ({"particle": {"a": ROD}, "particle.0.share": [1]}, {}, r"vary: particle\.0\.share: is part of particle, which"),
    ({"count": [4]}, {"count": [4]}, r"zip: count: is in vary, too; leave it out of one"),
    ({}, {"seed": [1, 2]}, r"zip: seed: seeds repeat all points; give them in vary"),
    ({}, {"count": [4, 5], "name": ["a"]}, r"zip: numbers of values differ: count has 2, name has 1"),
    ({}, {}, r"vary: is empty; give a key of the scene and its values"),
    ({"phases.7.type": [1]}, {}, r"scene: phases\.7\.type: there is no '7' in the scene"),
])  # fmt: skip
def test_what_cannot_be_varied_is_rejected(tmp_path: Path, vary: Any, together: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}") as raised:
        points(tmp_path, vary, together)
    assert "\n" not in str(raised.value)
