"""init: scenes to begin with, each valid, planned without a warning, and never over another file."""

from pathlib import Path

import pytest
from command_cases import Smarticles

from smarticles.starters import KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_planned_without_a_warning(kind: str, tmp_path: Path, smarticles: Smarticles) -> None:
    file = tmp_path / "mine.yaml"
    said = smarticles("init", kind, "--output", file)
    assert (said.status, said.err) == (0, "")
    assert said.out.splitlines()[1] == (f"next: smarticles plan {file}, smarticles run {file} --out runs/mine")
    planned = smarticles("plan", file)
    assert planned.status == 0
    assert "warning" not in planned.out
    assert planned.out.startswith(f"{kind}: ")


def test_nothing_is_overwritten_nor_written_through_a_link(tmp_path: Path, smarticles: Smarticles) -> None:
    mine = tmp_path / "scene.yaml"
    mine.write_text("precious")
    link = tmp_path / "link.yaml"
    link.symlink_to(tmp_path / "elsewhere.yaml")
    for place in (mine, link):
        said = smarticles("init", "--output", place)
        assert (said.status, said.err) == (2, f"smarticles: error: --output {place}: exists; choose another name\n")
    assert mine.read_text() == "precious"
    assert not (tmp_path / "elsewhere.yaml").exists()


def test_a_folder_that_is_missing_and_a_kind_that_is_not_known(tmp_path: Path, smarticles: Smarticles) -> None:
    said = smarticles("init", "--output", tmp_path / "no" / "scene.yaml")
    assert said.status == 2
    assert f"the folder {tmp_path / 'no'} does not exist; make it" in said.err
    assert "did you mean 'melting'?" in smarticles("init", "meltin").err
    assert "known: shaken, actuated, hook" in smarticles("init", "quiet").err
