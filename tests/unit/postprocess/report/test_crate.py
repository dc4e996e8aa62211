"""Metadata that make a run directory an RO-Crate."""

import json
from pathlib import Path
from typing import Any

import pytest
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from dem.record.run import open_run
from postprocess.report.crate import NAME, PROFILE, describe_run
from smarticles.main import main


def entities(path: Path) -> dict[str, dict[str, Any]]:
    return {one["@id"]: one for one in json.loads(path.read_text(encoding="utf-8"))["@graph"]}


def test_a_run_is_an_action_of_the_program(tmp_path: Path) -> None:
    directory = write_run(tmp_path / "run", SyntheticRun())
    found, manifest = entities(describe_run(directory)), open_run(directory).manifest
    assert found[NAME]["about"] == {"@id": "./"}
    root, action = found["./"], found["#run"]
    assert root["conformsTo"] == {"@id": PROFILE}
    assert root["mentions"] == {"@id": "#run"}
    assert all(root[key] for key in ("name", "description", "datePublished", "license"))
    assert (action["description"], action["startTime"]) == (manifest.command, manifest.started)
    assert action["object"] == {"@id": "scene.yaml"}
    assert action["actionStatus"] == "http://schema.org/CompletedActionStatus"
    assert action["endTime"] > action["startTime"]
    assert found["#smarticles"]["softwareVersion"] == manifest.versions["smarticles"]
    parts = {part["@id"] for part in root["hasPart"]}
    assert parts == {one.name + "/" * one.is_dir() for one in directory.iterdir()} - {NAME}
    assert {one["@id"] for one in action["result"]} == parts - {"scene.yaml"}
    assert all((directory / name).exists() for name in parts)


def test_a_failed_run_says_why(tmp_path: Path) -> None:
    action = entities(describe_run(write_run(tmp_path / "run", SyntheticRun(status="failed"))))["#run"]
    assert action["actionStatus"] == "http://schema.org/FailedActionStatus"
    assert action["error"]


def test_what_exists_is_left_as_it_is(tmp_path: Path) -> None:
    directory = write_run(tmp_path / "run", SyntheticRun())
    describe_run(directory)
    with pytest.raises(InputError, match=r"ro-crate-metadata\.json: exists and is left as it is; delete it"):
        describe_run(directory)


@pytest.mark.parametrize("option", [["--time", "1"], ["--all"], ["--output", "a.json"], ["--with", "forces"]])
def test_options_of_frames_are_rejected(tmp_path: Path, option: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    directory = write_run(tmp_path / "run", SyntheticRun())
    assert main(["export", str(directory), "--to", "ro-crate", *option]) == 2
    assert f"{option[0]}: " in capsys.readouterr().err
    assert not (directory / NAME).exists()
    assert main(["export", str(directory), "--to", "ro-crate"]) == 0
    assert str(directory / NAME) in capsys.readouterr().out
