"""A small run, and commands that are typed into a terminal."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from terminals import Terminal

Type = Callable[..., Terminal]

_SCENE = """\
schema_version: 1
engine: links
fidelity: draft
seed: 1
count: 12
phases:
  - {type: deposit, per_layer: 6}
  - {type: shake, duration_s: 0.2}
recording: {frame_interval_s: 0.1}
"""
_SWEEP = """\
schema_version: 1
name: friction
template: template.yaml
run_name: "mu{{ mu }}"
constants: {shake_s: SHAKE_S}
points: {grid: {mu: [0.2, 0.4]}}
"""


@pytest.fixture(scope="session")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with scene.yaml, a sweep file, and a finished run runs/a."""
    folder = tmp_path_factory.mktemp("here")
    (folder / "scene.yaml").write_text(_SCENE)
    template = _SCENE.replace("duration_s: 0.2", "duration_s: {{ shake_s }}")
    (folder / "template.yaml").write_text(template + "contact: {friction_smarticle: {{ mu }}}\n")
    for name, shake_s in (("sweep.yaml", "0.2"), ("long.yaml", "600")):
        (folder / name).write_text(_SWEEP.replace("SHAKE_S", shake_s))
    with typed(folder, "run", "scene.yaml", "--out", "runs/a") as terminal:
        assert terminal.end() == 0
    return folder


def typed(folder: Path, *words: str, **how: object) -> Terminal:
    """Type `smarticles` and words into a new terminal in a folder."""
    return Terminal([sys.executable, "-m", "smarticles", *words], folder=folder, **how)  # type: ignore[arg-type]


@pytest.fixture
def type_command(here: Path) -> Type:
    """Type a command into a new terminal, in the folder `here`."""
    return lambda *words, **how: typed(here, *words, **how)
