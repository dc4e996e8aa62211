"""The pinned packages are those that the project needs; `make lock` writes them."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
NAMES = {
    "requirements": ("core", "viz", "view", "export"),
    "requirements-dev": ("docs", "dev"),
    "requirements-bench": ("bench",),
}


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def asked_for(name: str) -> set[str]:
    """Names of packages that pyproject.toml asks for, of a file of pins."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lists = {"core": project["dependencies"], **project["optional-dependencies"]}
    assert sorted(lists) == sorted(extra for extras in NAMES.values() for extra in extras)
    words = [word for extra in NAMES[name] for word in lists[extra] if not word.startswith("smarticles[")]
    return {canonical(re.split(r"[<>=!~ \[;]", word)[0]) for word in words}


def pinned(name: str) -> list[str]:
    """Return the names in a file of pins, in its order."""
    head, *lines = (REPOSITORY / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    assert head.startswith("# Made by 'make lock' from pyproject.toml;")
    for line in lines:
        assert re.fullmatch(r"[\w.-]+==[\w.!+]+", line), f"{name}.txt: {line}"
    return [canonical(line.partition("==")[0]) for line in lines]


@pytest.mark.parametrize("name", NAMES)
def test_wanted_packages_are_pinned_once(name: str) -> None:
    found = pinned(name)
    assert len(found) > 5
    assert asked_for(name) <= set(found)
    assert len(set(found)) == len(found)
