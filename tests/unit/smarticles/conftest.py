"""Run directories to measure, a sweep to expand, and the command to call."""

from pathlib import Path

import pytest
import synthetic
from command_cases import SCENE, SWEEP, Said, Smarticles, WriteRun

from smarticles.main import main


@pytest.fixture
def smarticles(capsys: pytest.CaptureFixture[str]) -> Smarticles:
    """Calls the command in this process."""

    def call(*words: str | Path) -> Said:
        status = main([str(word) for word in words])
        return Said(status, *capsys.readouterr())

    return call


@pytest.fixture
def sweep_file(tmp_path: Path) -> Path:
    """A sweep of two runs, n5 and n6."""
    (tmp_path / "scene.yaml.j2").write_text(SCENE)
    file = tmp_path / "sweep.yaml"
    file.write_text(SWEEP)
    return file


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    """A scene of five smarticles."""
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE.replace("{{ count }}", "5"))
    return file


@pytest.fixture(scope="session")
def write_run() -> WriteRun:
    """Writes a finished run directory without running anything."""

    def write(directory: Path, **run: object) -> Path:
        written: Path = synthetic.write_run(directory, synthetic.SyntheticRun(**run))
        return written

    return write
