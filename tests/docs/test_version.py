"""One version, and one way to cite it."""

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
