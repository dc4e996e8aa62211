"""Hard cases end right, or in an error that says why; never in nonsense."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from smarticles.verification.hard.cases import CASES, checked

SHORT = [name for name, case in CASES.items() if case.short is not None]


@pytest.mark.engine
@pytest.mark.parametrize("name", SHORT)
def test_hard_case_on_yade(simulate: Callable[..., Any], tmp_path: Path, name: str) -> None:
    checks, _ = simulate(checked, name, "yade", "short", tmp_path / "run")
    assert checks
    assert not [check for check in checks if not check.good]


@pytest.mark.filterwarnings("ignore")  # of scenes that ask for trouble
@pytest.mark.parametrize("name", SHORT)
def test_hard_case_on_links(tmp_path: Path, name: str) -> None:
    if reason := CASES[name].absent.get("links"):
        pytest.skip(f"not applicable: {reason}")
    checks, _ = checked(name, "links", "short", tmp_path / "run")
    assert checks
    assert not [check for check in checks if not check.good]
