"""The ladder of accuracy: its rungs, what is left out, and the sweep that it becomes."""

from pathlib import Path

import pytest

from dem.errors import InputError
from dem.scene.reading import load_scene, scene_hash
from dem.scene.scene import Scene
from dem.setting.fidelity import FIDELITIES, fidelities
from studies.accuracy import BASE, Ladder, affordable, build_ladder, ladder_sweep, parse_seeds
from templates.sweep.expand import expand

SCENE = """\
schema_version: 1
name: "pile {{ of }} {% steel"
seed: 7
count: 20
fidelity: draft
phases:
  - {type: deposit}
  - {type: relax, duration_s: 0.3}
  - {type: shake, duration_s: 1.5}
"""


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return scene_of(tmp_path)


def scene_of(folder: Path, text: str = SCENE, *settings: str) -> Scene:
    file = folder / "scene.yaml"
    file.write_text(text, encoding="utf-8")
    return load_scene(file, settings)


def labels(ladder: Ladder, knob: str) -> list[tuple[str, str]]:
    return [(rung.label, rung.setting) for rung in ladder.rungs if rung.knob == knob]


def test_a_rung_differs_from_the_scene_in_its_knob_alone(scene: Scene) -> None:
    ladder = build_ladder(scene, source="scene.yaml")
    base = scene.model_dump()
    for rung in ladder.rungs:
        varied = ladder.scenes[rung.setting].model_dump()
        differing = {key for key in base if varied[key] != base[key]}
        assert differing == (
            set() if rung.setting == BASE else {"contact" if rung.knob == "restitution" else "fidelity"}
        )
    turned = ladder.scenes["time-step-0.45"].fidelity
    assert turned == scene.fidelity.model_copy(update={"time_step_fraction": 0.45})
    assert ladder.scenes["stiffness-x4"].fidelity.stiffness_N_per_m == 1000
    rows = ladder.scenes["two-rows"].fidelity
    assert (rows.rows, rows.pitch, rows.diameter_m) == (2, 1.0, None)
    assert ladder.scenes["reference"].fidelity.model_dump().items() >= FIDELITIES["reference"].items()


def test_the_scene_is_run_once_and_each_setting_once_per_seed(scene: Scene) -> None:
    ladder = build_ladder(scene, source="scene.yaml")
    points = expand(ladder_sweep(scene, ladder, (7, 3)))
    assert len(points) == 2 * len(ladder.settings) == 26
    # All settings with the first seed come first; its base is the scene itself, name and all.
    assert [point.name for point in points[:2]] == ["base_seed7", "time-step-0.45_seed7"]
    assert points[0].scene_sha256 == scene_hash(scene)
    assert {point.scene.seed for point in points[13:]} == {3}
    assert {point.name.removesuffix("_seed7") for point in points[:13]} == set(ladder.settings)


def test_the_scene_has_its_own_place_among_the_rungs(tmp_path: Path) -> None:
    settings = ("fidelity.time_step_fraction=0.6", "fidelity.pitch=1.1", "contact.restitution=0.6")
    ladder = build_ladder(scene_of(tmp_path, SCENE, *settings), source="scene.yaml")
    assert [name for name, setting in labels(ladder, "time-step")] == ["0.9", "0.6", "0.45", "0.225"]
    for knob, own in {"time-step": "0.6", "section": "pitch 1.1", "restitution": "0.6"}.items():
        assert (own, BASE) in labels(ladder, knob)
    assert ladder.references()["restitution"].label == "0.6"
    # No named fidelity is the scene itself.
    assert labels(ladder, "fidelity")[0] == ("draft", "draft")


@pytest.mark.parametrize("engine", ["yade", "links"])
def test_the_engine_is_a_knob_with_the_finest_of_links_as_its_reference(engine: str, tmp_path: Path) -> None:
    scene = scene_of(tmp_path, SCENE, f"engine={engine}", "fidelity=standard")
    ladder = build_ladder(scene, source="scene.yaml", knobs=["engine"])
    found = dict(labels(ladder, "engine"))
    assert list(found) == [*(f"{one} {name}" for one in ("yade", "links") for name in FIDELITIES), "links converged"]
    assert found[f"{engine} standard"] == BASE
    assert ladder.references()["engine"].label == "links converged"
    finer, finest = (ladder.scenes[found[f"links {name}"]].fidelity for name in ("converged", "reference"))
    assert finer.rows >= finest.rows
    assert finer.stiffness_N_per_m > finest.stiffness_N_per_m
    del found["links converged"]
    for name, setting in found.items():
        one = ladder.scenes[setting]
        assert one.engine == name.split()[0]
        assert one.fidelity.model_dump().items() >= fidelities(one.engine)[name.split()[1]].items()
    points = {point.name: point.scene for point in expand(ladder_sweep(scene, ladder, (7,)))}
    assert {points[f"{setting}_seed7"].engine for setting in found.values()} == {"yade", "links"}


def test_what_the_scene_cannot_have_is_left_out_and_said(tmp_path: Path) -> None:
    square = scene_of(tmp_path, SCENE, "smarticle.thickness_in_plane_m=1.27e-3")
    ladder = build_ladder(square, source="scene.yaml")
    assert [name for name, _ in labels(ladder, "section")] == ["pitch 1.3", "pitch 1", "pitch 0.5"]
    assert ladder.references()["section"].label == "pitch 0.5"
    assert [line.partition(":")[0] for line in ladder.left_out] == ["section two rows", "fidelity reference"]
    assert "2 rows of 0.00127 m do not fit" in ladder.left_out[0]
    assert ladder.references()["fidelity"].label == "standard"


def test_what_takes_too_long_is_left_out_but_never_the_scene(scene: Scene) -> None:
    ladder = build_ladder(scene, source="scene.yaml", knobs=["section", "fidelity"])
    cost = {name: 7200.0 if name in (BASE, "two-rows", "reference") else 60.0 for name in ladder.settings}
    kept = affordable(ladder, cost, 3600.0)
    assert set(kept.settings) == set(kept.scenes) == {BASE, "pitch-1", "pitch-0.5", "standard"}
    assert {knob: rung.label for knob, rung in kept.references().items()} == {
        "section": "pitch 0.5",
        "fidelity": "standard",
    }
    assert kept.left_out[0] == "section two rows: a run is expected to take 2 h, more than 1 h"


def test_seeds_are_whole_numbers_each_once() -> None:
    assert parse_seeds("3, 1,20") == (3, 1, 20)
    assert parse_seeds("1-3,7") == (1, 2, 3, 7)
    for text in ("3-1", "0-99999"):
        with pytest.raises(InputError, match=f"{text} must be an ascending range of at most 1000"):
            parse_seeds(text)
    for text in ("", "1,x", "1.5", "-1", "²"):
        with pytest.raises(InputError, match="must be whole numbers from 0, such as 1,2,3"):
            parse_seeds(text)
    with pytest.raises(InputError, match="--seeds 1,2,1: 1 is given twice"):
        parse_seeds("1,2,1")
