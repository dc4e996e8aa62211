"""What all tests share: reproducible random cases, and factories of scenes that are valid until a test breaks them."""

from __future__ import annotations

import copy
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

# The same cases on every machine, and no failure because a shared machine was slow.
settings.register_profile("suite", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("suite")


def changed(data: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """A copy with `{"phases.1.duration_s": 2}` and the like put in."""
    data = copy.deepcopy(data)
    for key, value in changes.items():
        here: Any = data
        *parents, last = key.split(".")
        for part in parents:
            here = here[int(part)] if isinstance(here, list) else here.setdefault(part, {})
        if isinstance(here, list):
            here[int(last)] = value
        else:
            here[last] = value
    return data


@pytest.fixture
def mount_disk(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """Mounts a real file system of its own of a size, `64k` and the like. Skips where that takes a root that is not."""
    mounted: list[Path] = []

    def mount(size: str) -> Path:
        folder = tmp_path / "small"
        folder.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(folder)]
        try:
            done = subprocess.run(command, capture_output=True, check=False).returncode == 0
        except OSError:
            done = False
        if not done:
            pytest.skip("a small tmpfs cannot be mounted here (needs root)")
        mounted.append(folder)
        return folder

    yield mount
    for folder in mounted:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


@pytest.fixture
def scene_data() -> Callable[..., dict[str, Any]]:
    """Plain data of a small scene: pour, rest, shake. Positional mapping: dotted keys to change."""

    def make(changes: dict[str, Any] | None = None) -> dict[str, Any]:
        data = {
            "schema_version": 1,
            "name": "small",
            "seed": 1,
            "count": 10,
            "fidelity": "draft",
            "phases": [
                {"type": "deposit", "per_layer": 5},
                {"type": "relax", "duration_s": 0.1},
                {"type": "shake", "duration_s": 0.2, "frequency_hz": 30, "peak_acceleration_g": 2},
            ],
        }
        return changed(data, changes or {})

    return make


@pytest.fixture
def make_scene(scene_data: Callable[..., dict[str, Any]]) -> Callable[..., Scene]:
    """The same, validated."""

    def make(changes: dict[str, Any] | None = None) -> Scene:
        return parse_scene(scene_data(changes), source="scene.yaml")

    return make


def pytest_configure() -> None:
    """Let Ctrl-C through: a shell that starts tests in the background ignores it for them and all that they start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
