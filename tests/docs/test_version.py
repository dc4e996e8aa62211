"""One version, and one way to cite it."""

import json
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


def test_codemeta_says_what_the_citation_and_the_project_say() -> None:
    found = json.loads((REPOSITORY / "codemeta.json").read_text(encoding="utf-8"))
    citation, project = _citation(), _project()
    assert found["version"] == project["version"]
    assert found["name"] == project["name"]
    assert found["alternateName"] == citation["title"]
    assert found["description"] == citation["abstract"]
    assert found["dateModified"] == citation["date-released"]
    assert found["license"] == f"https://spdx.org/licenses/{citation['license']}"
    assert project["license"]["text"] == citation["license"]
    assert [one["name"] for one in found["author"]] == [one["name"] for one in citation["authors"]]
    assert found["keywords"] == citation["keywords"]
    assert found["runtimePlatform"] == f"Python {project['requires-python']}"
    assert found["softwareRequirements"] == project["dependencies"]
    assert [one["name"] for one in found["referencePublication"]] == [one["title"] for one in citation["references"]]
