"""A measure is one file with one registration: tables have its columns, and nothing else names it."""

import sys
from pathlib import Path

import pytest
from synthetic import SyntheticRun, write_run

from dem.record.run import Run
from postprocess import measure_run, measures, summarise_run
from postprocess.measures.registry import registered

SOURCE = """
from postprocess.measures.registry import FrameMeasure, Quantity

MEASURES = (
    FrameMeasure(
        name="newest",
        place=53,
        quantities=(Quantity("newest height", "m"), Quantity("{other}", "-")),
        take=lambda frame, run: (frame.vertices[..., 2].max(), float(run.manifest.count)),
    ),
)
"""


@pytest.fixture
def add_measure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Adds a module to the package for the time of a test."""

    def add(other: str) -> None:
        (tmp_path / "newest.py").write_text(SOURCE.replace("{other}", other))
        monkeypatch.setattr(measures, "__path__", [*measures.__path__, str(tmp_path)])
        registered.cache_clear()

    yield add
    sys.modules.pop("postprocess.measures.newest", None)
    registered.cache_clear()


def test_a_new_file_is_a_new_measure_in_every_table(tmp_path: Path, add_measure) -> None:
    run = write_run(tmp_path / "run", SyntheticRun(frames_per_phase=2))
    before = list(measure_run(Run(run), costly="never").columns)
    add_measure("newest share")
    table = measure_run(Run(run), costly="never")
    new = ["newest height [m]", "newest share [-]"]
    at = before.index("rattlers [-]") + 1
    assert list(table.columns) == [*before[:at], *new, *before[at:]]
    assert (table["newest share [-]"] == 12).all()
    assert table["newest height [m]"].gt(0).all()
    assert "newest height SE [m]" in summarise_run(Run(run), costly="never")


def test_columns_that_are_there_already_are_rejected(add_measure) -> None:
    add_measure("contacts mean")
    with pytest.raises(ValueError, match=r"measures share a header: contacts mean \[-\]"):
        registered()
