"""`import smarticles`: what it offers, and that nothing is loaded before it is used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from command_cases import WriteRun

import smarticles
from dem.errors import InputError, RunError
from dem.scene.reading import parse_scene

HEAVY = (
    "dem",
    "h5py",
    "numpy",
    "pandas",
    "postprocess",
    "pydantic",
    "pyvista",
    "rich",
    "templates",
    "vtkmodules",
    "yade",
)


def loaded_by(code: str) -> set[str]:
    """Top-level packages that a fresh process has loaded after some code."""
    script = f"{code}; import sys; print(*{{name.partition('.')[0] for name in sys.modules}})"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, text=True)
    return set(answer.stdout.split())


def test_importing_it_loads_nothing() -> None:
    loaded = loaded_by("import smarticles")
    assert "smarticles" in loaded
    assert not loaded & set(HEAVY)


def test_a_scene_needs_neither_engine_nor_measures() -> None:
    loaded = loaded_by("from smarticles import Scene, load_scene")
    assert "dem" in loaded
    assert not loaded & {"pandas", "postprocess", "pyvista", "vtkmodules", "yade"}


def test_every_name_is_there_and_the_stub_tells_the_same() -> None:
    stub = ast.parse(Path(smarticles.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    told = {
        alias.asname or alias.name
        for node in stub.body
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    } | {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)}
    assert told == set(smarticles.__all__) == set(dir(smarticles))
    assert all(getattr(smarticles, name) is not None for name in smarticles.__all__)
    assert smarticles.measures.packing_fraction.__module__ == "postprocess.measures.packing"


def test_an_unknown_name_is_refused_and_the_known_ones_are_named() -> None:
    with pytest.raises(AttributeError, match=r"'nothing'; known: .*load_scene, measures, read, run, sweep"):
        _ = smarticles.nothing  # type: ignore[attr-defined]


def test_a_run_directory_is_read_part_by_part(write_run: WriteRun, tmp_path: Path) -> None:
    found = smarticles.read(write_run(tmp_path / "run", count=5))
    assert found.manifest.count == 5
    assert found.frames[-1].count == 5
    assert len(found.series) > 1
    assert found.frames is found.frames


def test_what_is_no_run_directory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no-run"):
        smarticles.read(tmp_path / "no-run")


def test_a_scene_that_is_not_valid_is_refused_with_the_way_out(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("schema_version: 1\nseed: 1\ncount: -5\nphases: [{type: deposit}]\n")
    with pytest.raises(InputError, match=r"scene.yaml: count: -5 is out of range; use "):
        smarticles.run(tmp_path / "scene.yaml", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_directory_that_holds_something_else_is_left_alone(tmp_path: Path) -> None:
    scene = parse_scene({"schema_version": 1, "seed": 1, "count": 1, "phases": [{"type": "deposit"}]}, source="here")
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises((InputError, RunError), match=r"yade|--out "):
        smarticles.run(scene, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
