"""Progress of a run, for a display and for other processes."""

import json
import math
from pathlib import Path

import pytest

from dem.record import progress as module
from dem.record.document import Progress
from dem.record.progress import Estimate, PhaseCost, ProgressWriter, row_of


class Wall:
    """Wall time under the test's control."""

    now = 100.0


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Wall:
    clock = Wall()
    monkeypatch.setattr(module, "monotonic", lambda: clock.now)
    return clock


def test_file_states_how_far_the_run_is(tmp_path: Path, wall: Wall) -> None:
    costs = [
        PhaseCost(simulated_s=3.0, wall_s=10.0, known=False, grows=True),
        PhaseCost(simulated_s=5.0, wall_s=30.0, known=True),
    ]
    writer = ProgressWriter(tmp_path, 270, costs)
    writer.begin(phase="shake", index=1, start=3.0, end=8.0)
    wall.now += 5
    writer.update(time=4.0, phi=0.123, count=270)
    found = json.loads((tmp_path / "progress.json").read_text())
    assert found == {
        "phase": "shake",
        "index": 1,
        "phases": 2,
        "time_s": 4.0,
        "end_s": 8.0,
        "phi": 0.123,
        "count": 270,
        "total": 270,
        "wall_s": 5.0,
        "fraction": pytest.approx(16 / 40),  # the pour, and a fifth of the shaking
        "left_s": pytest.approx(24.0),  # as planned, since nothing has been measured yet
    }
    assert [path.name for path in tmp_path.iterdir()] == ["progress.json"]
    writer.finish()
    assert list(tmp_path.iterdir()) == []


def test_the_first_record_comes_before_the_first_phase(tmp_path: Path, wall: Wall) -> None:
    writer = ProgressWriter(tmp_path, 2, [PhaseCost(simulated_s=1.0, wall_s=1.0, known=True)])
    writer.update(time=0.0, phi=math.nan, count=0)
    row = row_of(Progress(**json.loads((tmp_path / "progress.json").read_text())))
    assert (row.label, row.fraction, row.left_s) == ("starting", None, None)


@pytest.mark.parametrize("slower", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("start_s", [0.01, 1.0])
def test_the_time_left_is_right_within_a_factor_from_the_beginning(slower: float, start_s: float) -> None:
    # A machine of another speed than the plan's: a run that takes 26 s is never said to take 1869 s more.
    planned = 26.0 / slower
    estimate = Estimate([PhaseCost(simulated_s=1.0, wall_s=planned, known=True)])
    for percent in range(1, 100):
        share = percent / 100
        left = estimate.left_s(0, share, start_s + 26.0 * share)
        true = 26.0 * (1 - share)
        # At first the plan decides, which is wrong by the machine's speed; later the measured pace does.
        allowed = max(slower, 1 / slower) if share < 0.3 else 1.6
        assert true / allowed / 1.1 - 0.5 < left < 1.1 * allowed * true + 0.5, percent


def test_a_resumed_run_is_judged_by_the_time_since_its_resumption() -> None:
    estimate = Estimate([PhaseCost(simulated_s=10.0, wall_s=100.0, known=True)])
    assert estimate.left_s(0, 8.0, 1.0) == pytest.approx(20.0)
    # One second for 10 s of planned work: ten times as fast, tempered by the plan.
    assert 1.0 < estimate.left_s(0, 9.0, 2.0) < 6.0


def test_a_phase_that_lasts_longer_than_expected_is_never_said_to_be_over() -> None:
    cost = PhaseCost(simulated_s=1.0, wall_s=1.0, known=False)
    shares = [cost.share(time) for time in (0.4, 0.8, 1.0, 2.0, 4.0)]
    assert shares == sorted(shares)
    assert shares[0] == pytest.approx(0.4)
    assert 0.9 < shares[2] < shares[-1] < 1


def test_a_growing_pile_does_most_work_at_the_end() -> None:
    cost = PhaseCost(simulated_s=1.0, wall_s=1.0, known=False, grows=True)
    assert cost.share(0.5) == pytest.approx(0.25)


def test_rows_name_phase_and_numbers() -> None:
    numbers = {"phases": 4, "total": 40, "phi": 0.1}
    pour = Progress(phase="deposit", index=0, time_s=0.4, count=30, fraction=0.2, left_s=9.4, **numbers)
    assert row_of(pour).to_text() == "deposit 1/4 20 %, t = 0.40 s  30 of 40 poured, 0:09 left"
    shake = Progress(phase="shake", index=2, time_s=1.4, count=40, fraction=0.7, left_s=3.0, **numbers)
    assert row_of(shake).to_text() == "shake 3/4 70 %, t = 1.40 s  φ 0.100, 0:03 left"
    assert row_of(shake, label="a").to_text() == "a 70 %, shake 3/4  t = 1.40 s, 0:03 left"


def test_bodies_that_hang_have_no_packing_fraction(tmp_path: Path, wall: Wall) -> None:
    writer = ProgressWriter(tmp_path, 2, lifted={1})
    for index, phi in ((0, 0.1), (1, None)):
        writer.begin(phase="lift", index=index, start=0.0, end=1.0)
        writer.update(time=0.2, phi=0.1, count=2)
        assert json.loads((tmp_path / "progress.json").read_text()).get("phi") == phi


def test_a_checkpoint_is_reported_at_once(tmp_path: Path, wall: Wall) -> None:
    def written() -> tuple[float, float | None]:
        data = json.loads((tmp_path / "progress.json").read_text())
        return data["time_s"], data.get("checkpoint_s")

    writer = ProgressWriter(tmp_path, 2)
    writer.begin(phase="relax", index=0, start=0.0, end=1.0)
    writer.checkpointed(0.1)  # nothing else is known yet
    assert not (tmp_path / "progress.json").exists()
    writer.update(time=0.2, phi=0.1, count=2)
    assert written() == (0.2, 0.1)
    wall.now += 0.01
    writer.update(time=0.3, phi=0.1, count=2)
    writer.checkpointed(0.3)
    assert written() == (0.3, 0.3)
    wall.now += 2
    writer.update(time=0.5, phi=0.1, count=2)
    assert written() == (0.5, 0.3)


def test_at_most_once_per_second_and_at_once_in_a_new_phase(tmp_path: Path, wall: Wall) -> None:
    writer = ProgressWriter(tmp_path, 2)
    writer.begin(phase="relax", index=0, start=0.0, end=1.0)

    def written(time: float) -> bool:
        (tmp_path / "progress.json").unlink(missing_ok=True)
        writer.update(time=time, phi=0.1, count=2)
        return (tmp_path / "progress.json").exists()

    assert written(0.1)
    wall.now += 0.99
    assert not written(0.2)
    wall.now += 0.02
    assert written(0.3)
    writer.begin(phase="shake", index=1, start=1.0, end=2.0)
    assert written(1.0)
