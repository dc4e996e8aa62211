"""Bodies of a mixture belong to entries of the scene's list, whatever sizes a spread makes of an entry."""

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image
from scenes import small
from synthetic import SyntheticRun, write_run

from dem.body.state import RigidState
from dem.record.frame import segment_mesh
from dem.record.frames import FrameWriter
from dem.record.names import MANIFEST, SCENE
from dem.record.run import Run
from dem.run.run import manifest
from dem.scene.reading import dump_scene
from postprocess.bodies.colours import ColourScale, Paint, colour_field, scalars
from postprocess.bodies.fields import BY_NAME, link_values
from postprocess.geometry.bars import entries
from postprocess.pictures.canvas import Canvas
from postprocess.pictures.render import render_run
from postprocess.view import RunView

ROD: dict[str, Any] = {"shape": "rod", "length_m": 0.012, "diameter_m": 0.001}
STAPLE: dict[str, Any] = {"shape": "staple", "crown_m": 0.008, "leg_m": 0.006, "diameter_m": 0.001}


def run_of(out: Path, *particle: dict[str, Any], count: int = 12) -> Run:
    """A run directory with one frame, in which all bodies lie one above the other."""
    out.mkdir()
    scene = small({"engine": "links", "count": count, "particle": list(particle)})
    steps = [1e-5] * len(scene.phases)
    manifest(scene, out, steps=steps, command="test", made_by=("links", "1"), threads=1).write(out / MANIFEST)
    (out / SCENE).write_text(dump_scene(scene), encoding="utf-8")
    assert scene.mixture is not None
    state = RigidState(
        mixture=scene.mixture,
        kind=scene.mixture.of,
        positions=np.arange(1, count + 1)[:, None] * [0.0, 0.0, 0.003],
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        velocities=np.zeros((count, 3)),
        spins=np.zeros((count, 3)),
    )
    mesh = segment_mesh(state, contacts=np.zeros(count, int), time=0.0, floor=0.0, phase=0)
    FrameWriter(out).write(mesh, 0.0)
    return Run(out)


def test_all_sizes_of_an_entry_are_one_entry(tmp_path: Path) -> None:
    spread = ROD | {"spread": 0.1}
    run = run_of(tmp_path / "a", spread, STAPLE, spread | {"length_m": 0.02}, ROD)
    assert entries(run) == [0] * 16 + [1] + [2] * 16 + [3]
    field, (frame,) = BY_NAME["entry"], run.frames
    found = link_values(field, frame, run)
    assert found is not None
    bars, lengths = np.bincount(frame.body), np.linalg.norm(np.diff(frame.segments, axis=1), axis=2)[:, 0]
    longest = np.array([lengths[frame.body == body].max() for body in range(frame.count)])
    # Staples have three bars; of the rods, long ones are of entry 2.
    assert ((found[:, 0] == 1) == (bars == 3)).all()
    assert ((found[:, 0] == 2) == (longest > 0.0155)).all()
    assert set(found[:, 0]) == {0, 1, 2, 3}
    assert entries(run_of(tmp_path / "b", STAPLE, ROD)) == [0, 1]


def test_a_legend_leaves_out_runs_without_the_field(tmp_path: Path) -> None:
    runs = [run_of(tmp_path / "mixed", ROD, STAPLE), Run(write_run(tmp_path / "smarticles", SyntheticRun()))]
    assert list(ColourScale.of(BY_NAME["entry"], (0.0, 1.0), runs).labels.values()) == ["0 rod", "1 staple"]


def test_entries_without_bodies_make_no_kinds(tmp_path: Path) -> None:
    run = run_of(tmp_path / "a", ROD | {"share": 0}, STAPLE | {"share": 1}, ROD | {"share": 1, "spread": 0.1})
    assert entries(run) == [1] + [2] * 16
    assert dict(BY_NAME["entry"].names(run)) == {1: "1 staple", 2: "2 rod"}
    alone = run_of(tmp_path / "b", ROD | {"share": 0}, STAPLE | {"share": 1})
    assert colour_field(None, alone).name == "contacts"


def test_mixtures_are_coloured_by_entry_and_one_entry_by_contacts(tmp_path: Path) -> None:
    assert colour_field(None, run_of(tmp_path / "two", ROD, STAPLE)).name == "entry"
    assert colour_field(None, run_of(tmp_path / "one", ROD | {"spread": 0.1})).name == "contacts"


def test_a_legend_names_the_entries_in_their_colours(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", ROD | {"spread": 0.2}, STAPLE)
    scale = ColourScale.of(BY_NAME["entry"], (0.0, 1.0), [run])
    assert dict(scale.labels) == {0.0: "0 rod", 1.0: "1 staple"}
    image = np.asarray(Image.open(render_run(run.path, output=tmp_path / "a.png", size=(500, 500))).convert("RGB"))
    below = image[-50:]  # bars and legend, where nothing is shaded
    for number in (0, 1):
        colour = scale.painted(np.array(number))
        # A square of about 10 pixels a side.
        assert 80 < (below == colour).all(axis=2).sum() < 160
    # Both colours are in the picture, and no third one: sizes have no colours of their own.
    shaded = image[60:-50].reshape(-1, 3).astype(float)
    shaded = shaded[np.ptp(shaded, axis=1) > 60]
    directions = shaded / np.linalg.norm(shaded, axis=1, keepdims=True)
    wanted = scale.painted(np.array([0, 1])).astype(float)
    near = directions @ (wanted / np.linalg.norm(wanted, axis=1, keepdims=True)).T > 0.97
    assert near.any(axis=0).all()
    assert near.any(axis=1).mean() > 0.9


def test_more_names_than_a_legend_holds_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_of(tmp_path / "run", ROD | {"spread": 0.2}, count=200)
    written = Mock()
    monkeypatch.setattr(Canvas, "_write", written)
    render_run(run.path, output=tmp_path / "a.png", size=(200, 200), color_by="kind")
    texts = [call.args[2] for call in written.call_args_list if call.args[1].startswith("legend ")]
    assert texts[0].startswith("0 rod ")
    assert texts[-1] == "and 8 more"  # of 16 sizes
    assert len(texts) == 9


def test_runs_side_by_side_share_a_legend(tmp_path: Path) -> None:
    one, other = run_of(tmp_path / "a", ROD, STAPLE), run_of(tmp_path / "b", STAPLE | {"spread": 0.1}, ROD)
    labels = ColourScale.of(BY_NAME["entry"], (0.0, 1.0), [one, other]).labels
    assert list(labels.values()) == ["0 rod or 0 staple", "1 staple or 1 rod"]


def test_named_colours_are_distinct_and_numbers_keep_theirs(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", ROD | {"spread": 0.2}, STAPLE)
    named = ColourScale.of(BY_NAME["kind"], (0.0, 16.0), [run]).painted(np.arange(17))
    assert len({tuple(colour) for colour in named.tolist()}) == 17
    values = scalars(BY_NAME["smarticle_id"], run.frames[-1], run)
    plain = ColourScale.of(BY_NAME["smarticle_id"], (0.0, 1.0), [run])
    assert not plain.labels
    assert plain.painted(values)[0, 0].tolist() == Paint("#e07070").rgb.tolist()  # hue 0


def test_the_page_of_a_run_has_the_legend(tmp_path: Path) -> None:
    view = RunView(run_of(tmp_path / "run", ROD | {"spread": 0.2}, STAPLE).path)
    view.draw()
    assert view.legend() == [{"colour": "#56b4e9", "label": "0 rod"}, {"colour": "#e69f00", "label": "1 staple"}]
    view.colour_by("smarticle_id")
    assert view.legend() == []
    view.colour_by("contacts")
    view.draw()
    assert [row["label"] for row in view.legend()] == ["1", "0"]  # a scale has its greatest value on top
