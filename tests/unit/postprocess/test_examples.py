"""The examples of docstrings run, and give what they say; `runs/pile` is a made-up run."""

import doctest
import importlib
import importlib.util
import pkgutil
from pathlib import Path

import pytest
from synthetic import write_run

PACKAGES = ("dem", "postprocess", "studies")


def modules_with_examples() -> list[str]:
    found = []
    for package in PACKAGES:
        path = importlib.import_module(package).__path__
        for module in pkgutil.walk_packages(path, f"{package}."):
            source = importlib.util.find_spec(module.name)
            if source is not None and source.origin and ">>> " in Path(source.origin).read_text(encoding="utf-8"):
                found.append(module.name)
    return found


@pytest.fixture(scope="module")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("examples")
    (folder / "runs").mkdir()
    write_run(folder / "runs" / "pile")
    return folder


@pytest.mark.parametrize("name", modules_with_examples())
def test_examples_of_a_module(name: str, workplace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(workplace)
    outcome = doctest.testmod(importlib.import_module(name), raise_on_error=False, verbose=False)
    assert outcome.failed == 0
    assert outcome.attempted > 0
