"""What all tests of studies share."""

from __future__ import annotations

from importlib import import_module

import pytest

from studies.registry import STUDIES


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves out the figures of all studies, which take most of the time."""
    for name in [*{study.folder.name for study in STUDIES.values()}, "accuracy"]:
        monkeypatch.setattr(import_module(f"studies.{name}.figures"), "draw", lambda *_, **__: [])
