"""One version, and one way to cite it."""

from __future__ import annotations

import datetime
import re
import subprocess
import sys
import tomllib
from typing import Any

import yaml
from pages import REPOSITORY


def _project() -> dict[str, Any]:
    project: dict[str, Any] = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return project


def _citation() -> dict[str, Any]:
    citation: dict[str, Any] = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))
    return citation


def test_one_version_everywhere() -> None:
    version = _project()["version"]
    changes = re.findall(r"^## (.+)$", (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    released = [title for title in changes if title != "Unreleased"]
    said = subprocess.run(
        [sys.executable, "-m", "smarticles", "--version"], capture_output=True, text=True, check=True, cwd=REPOSITORY
    ).stdout
    assert _citation()["version"] == version
    assert released[0].split()[0] == version
    assert said.split() == ["smarticles", version]


def test_day_of_the_release_is_the_same_everywhere() -> None:
    changes = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")
    day = re.search(r"^## \d+\.\d+\.\d+ \((.+)\)$", changes, re.MULTILINE)
    assert day is not None, "the newest section of CHANGELOG.md: '## VERSION (YYYY-MM-DD)'"
    assert day[1] == _citation()["date-released"] == datetime.date.fromisoformat(day[1]).isoformat()


def test_citation_follows_its_format() -> None:
    """Citation File Format 1.2.0: required keys, an entity as author, an SPDX licence."""
    citation = _citation()
    assert citation["cff-version"] == "1.2.0"
    assert isinstance(citation["message"], str)
    assert isinstance(citation["title"], str)
    assert citation["type"] == "software"
    assert citation["authors"] == [{"name": "The smarticle simulator's authors"}]
    assert citation["license"] == _project()["license"]["text"]
    for work in citation["references"]:
        assert {"type", "title", "authors"} <= set(work)
        assert all({"family-names", "given-names"} == set(author) for author in work["authors"])
    known = {
        *("cff-version", "message", "type", "title", "abstract", "authors", "version", "date-released", "license"),
        *("keywords", "references"),
    }
    assert set(citation) == known
