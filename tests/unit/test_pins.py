"""The pinned packages are those that the project needs; `make lock` writes them."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
NAMES = ("requirements", "requirements-dev", "requirements-bench")


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def asked_for(name: str) -> set[str]:
    """Return the names in a file of wanted packages."""
    lines = (REPOSITORY / f"{name}.in").read_text(encoding="utf-8").splitlines()
    return {canonical(re.split(r"[<>=!~ \[;]", line)[0]) for line in lines if line and not line.startswith("#")}


def pinned(name: str) -> list[str]:
    """Return the names in a file of pins, in its order."""
    head, *lines = (REPOSITORY / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    assert head.startswith(f"# Made by 'make lock' from {name}.in;")
    for line in lines:
        assert re.fullmatch(r"[\w.-]+==[\w.!+]+", line), f"{name}.txt: {line}"
    return [canonical(line.partition("==")[0]) for line in lines]


@pytest.mark.parametrize("name", NAMES)
def test_wanted_packages_are_pinned_once(name: str) -> None:
    found = pinned(name)
    assert len(found) > 5
    assert asked_for(name) <= set(found)
    assert len(set(found)) == len(found)


def test_no_package_is_pinned_in_two_files() -> None:
    for one, other in combinations(NAMES, 2):
        assert not set(pinned(one)) & set(pinned(other)), f"{one}.txt and {other}.txt"
