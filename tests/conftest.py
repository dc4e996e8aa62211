"""What all tests share: reproducible random cases, and factories of scenes that are valid until a test breaks them."""

import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from scenes import SMALL, changed

# The same cases on every machine, and no failure because a shared machine was slow.
settings.register_profile("suite", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("suite")


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
        return changed(SMALL, changes or {})

    return make


def pytest_configure() -> None:
    """Let Ctrl-C through: a shell that starts tests in the background ignores it for them and all that they start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
