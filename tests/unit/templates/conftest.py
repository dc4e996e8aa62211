"""Small sweeps in a temporary directory."""

from pathlib import Path

import pytest
from sweep_cases import SCENE, SWEEP, MakeFolder, WriteSweep

from templates.sweep.expand import expand
from templates.sweep.folder import Folder, create_folder
from templates.sweep.sweep_file import load_sweep


@pytest.fixture
def write_sweep(tmp_path: Path) -> WriteSweep:
    """Writes sweep, template and other files; returns the sweep file."""

    def write(sweep: str = SWEEP, scene: str = SCENE, **others: str) -> Path:
        (tmp_path / "scene.yaml.j2").write_text(scene, encoding="utf-8")
        for name, text in others.items():
            (tmp_path / name.replace("_csv", ".csv")).write_text(text, encoding="utf-8")
        file = tmp_path / "sweep.yaml"
        file.write_text(sweep, encoding="utf-8")
        return file

    return write


@pytest.fixture
def make_folder(tmp_path: Path, write_sweep: WriteSweep) -> MakeFolder:
    """Makes the directory of a sweep."""

    def make(sweep: str = SWEEP, out: str = "out") -> Folder:
        loaded = load_sweep(write_sweep(sweep))
        points = expand(loaded)
        return create_folder(
            tmp_path / out,
            loaded,
            points,
            command="smarticles sweep sweep.yaml --out out",
            versions={"smarticles": "0"},
            expected_s=[float(point.scene.count) for point in points],
        )

    return make
