"""Progress of a run, on the terminal and for other processes."""

import json
from pathlib import Path

import pytest

from dem.record import progress as module
from dem.record.progress import ProgressWriter


class Wall:
    """Wall time under the test's control."""

    now = 100.0


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Wall:
    clock = Wall()
    monkeypatch.setattr(module, "monotonic", lambda: clock.now)
    return clock


def test_file_states_how_far_the_run_is(tmp_path: Path, wall: Wall) -> None:
    bar = ProgressWriter(tmp_path, 270)
    bar.begin(phase="shake", start=3.0, time=3.0, end=8.0)
    wall.now += 5
    bar.update(time=4.5, phi=0.123, count=270)
    assert json.loads((tmp_path / "progress.json").read_text()) == {
        "phase": "shake",
        "time_s": 4.5,
        "end_s": 8.0,
        "phi": 0.123,
        "count": 270,
        "wall_s": 5.0,
    }
    assert [path.name for path in tmp_path.iterdir()] == ["progress.json"]
    bar.finish()
    assert list(tmp_path.iterdir()) == []


def test_a_checkpoint_is_reported_at_once(tmp_path: Path, wall: Wall) -> None:
    def written() -> tuple[float, float | None]:
        data = json.loads((tmp_path / "progress.json").read_text())
        return data["time_s"], data.get("checkpoint_s")

    bar = ProgressWriter(tmp_path, 2)
    bar.begin(phase="relax", start=0.0, time=0.0, end=1.0)
    bar.checkpointed(0.1)  # nothing else is known yet
    assert not (tmp_path / "progress.json").exists()
    bar.update(time=0.2, phi=0.1, count=2)
    assert written() == (0.2, 0.1)
    wall.now += 0.01
    bar.update(time=0.3, phi=0.1, count=2)
    bar.checkpointed(0.3)
    assert written() == (0.3, 0.3)
    wall.now += 2
    bar.update(time=0.5, phi=0.1, count=2)
    assert written() == (0.5, 0.3)


def test_at_most_once_per_second_and_at_once_in_a_new_phase(tmp_path: Path, wall: Wall) -> None:
    bar = ProgressWriter(tmp_path, 2)
    bar.begin(phase="relax", start=0.0, time=0.0, end=1.0)

    def written(time: float) -> bool:
        (tmp_path / "progress.json").unlink(missing_ok=True)
        bar.update(time=time, phi=0.1, count=2)
        return (tmp_path / "progress.json").exists()

    assert written(0.1)
    wall.now += 0.99
    assert not written(0.2)
    wall.now += 0.02
    assert written(0.3)
    bar.begin(phase="shake", start=1.0, time=1.0, end=2.0)
    assert written(1.0)
