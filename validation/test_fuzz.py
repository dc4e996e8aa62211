"""Tests of `validation.fuzz`: draws repeat, failures are found, counted and kept."""

import random
from pathlib import Path

import pytest

from dem.errors import InputError
from validation.fuzz import Lines, Tally, check_line, check_scene, nothing_started

GOOD = {"schema_version": 1, "engine": "links", "seed": 1, "count": 3, "phases": [{"type": "deposit"}]}


def test_scenes_are_planned_or_rejected(tmp_path: Path) -> None:
    assert check_scene(GOOD, tmp_path) == "planned"
    assert check_scene({**GOOD, "count": -1}, tmp_path) == "rejected"
    assert check_scene("count: [", tmp_path) == "rejected"


@pytest.mark.parametrize("message", ["two\nlines", "x" * 2000])
def test_a_bad_message_is_a_failure(message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def rejecting(*_: object, **__: object) -> None:
        raise InputError(message)

    monkeypatch.setattr("validation.fuzz.parse_scene", rejecting)
    tally = Tally(tmp_path)
    for _ in range(2):
        tally.call(lambda: check_scene(GOOD, tmp_path), "example")
    assert list(tally.failures.values()) == [2]
    assert (tmp_path / "001.txt").read_text(encoding="utf-8") == "example"


def test_a_hang_and_a_heap_of_memory_are_failures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def hanging() -> str:
        while True:
            pass

    monkeypatch.setattr("validation.fuzz.MOST_S", 0.1)
    tally = Tally(tmp_path)
    tally.call(hanging, "hangs")
    tally.call(lambda: str(len(bytearray(2**31))), "swells")
    assert [key.split()[0] for key in tally.failures] == ["LateError", "MemoryError"]


def test_lines_are_drawn_alike_and_start_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = Lines([])
    assert lines.draw(random.Random(5)) == lines.draw(random.Random(5))
    (tmp_path / "scene.yaml").write_text(str(GOOD), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with nothing_started():
        assert check_line(["plan", "absent.yaml"]) == "status 2"
        assert check_line(["run", "scene.yaml", "--out", "run"]) == "status 130"
    assert not (tmp_path / "run").exists()
