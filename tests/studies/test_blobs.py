"""Known answers of the measures of blobs of worms, on curves that are made by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dem.errors import InputError
from postprocess.statistics.points import SEED
from studies import blob_lift, blob_tangle, blob_topple

SHARES = (blob_lift.SHARE, blob_lift.OTHERS)


def frame(starts: np.ndarray, step: tuple[float, float, float], bodies: int) -> Any:
    segments = np.stack([starts, starts + np.array(step)], axis=1)
    return SimpleNamespace(segments=segments, body=np.arange(bodies), count=bodies, time=0.0)


def test_slenderness_is_that_of_a_column() -> None:
    rng = np.random.default_rng(1)
    places = rng.normal(size=(20_000, 3)) * [1e-3, 1e-3, 4e-3]
    assert blob_topple.slenderness(frame(places, (0.0, 0.0, 0.0), 20_000)) == pytest.approx(4, rel=0.02)


def test_worms_that_touch_are_one_cluster() -> None:
    # Four parallel worms: three a diameter apart, one far away.
    starts = np.array([[0, 0, 0], [0, 1e-3, 0], [0, 2e-3, 0], [0, 9e-3, 0]], dtype=float)
    assert blob_topple.largest_cluster(frame(starts, (0.01, 0.0, 0.0), 4), 1e-3) == 0.75
    assert blob_topple.largest_cluster(frame(2 * starts, (0.01, 0.0, 0.0), 4), 1e-3) == 0.25


def test_gripped_worms_are_those_that_move_with_the_end_piece() -> None:
    starts = np.array([[0, 0, 0], [0.02, 0, 0], [0.04, 0, 0]], dtype=float)
    one, other = frame(starts, (0.01, 0, 0), 3), frame(starts, (0.01, 0, 0), 3)
    one.time, other.time = 10.2, 10.6
    other.segments[0, 1] += [0, 0, 5e-3 * 0.4]  # one node held
    other.segments[1] += [0, 0, 1.9e-3]  # drawn along
    run: Any = SimpleNamespace(
        phases=[SimpleNamespace(index=0, type="deposit"), SimpleNamespace(index=1, type="lift")],
        scene={"phases": [{}, {"distance_m": 0.015, "speed_m_per_s": 5e-3}]},
        frames=[one, other],
        series=SimpleTimes({"phase": np.array([0, 1])}, np.array([9.0, 10.0])),
    )
    np.testing.assert_array_equal(blob_lift.gripped(run), [True, False, False])


class SimpleTimes(dict[str, np.ndarray]):
    """Series of a run that has times."""

    def __init__(self, data: dict[str, np.ndarray], time: np.ndarray) -> None:
        super().__init__(data)
        self.time = time


def test_findings_compare_the_quiet_blob_with_the_most_active_one_seed_by_seed() -> None:
    rows = [
        {SEED: seed, blob_lift.ACTIVE: hertz, blob_lift.RISE: rise + 1e-3 * seed} | dict.fromkeys(SHARES, share)
        for hertz, rise, share in ((0.0, 0.013, 0.97), (1.0, 0.009, 0.5), (2.0, 0.008, 0.3))
        for seed in (1, 2, 3)
    ]
    (finding,) = (one for one in blob_lift.STUDY.findings if one.id == "quiet-above-active")
    found = finding.outcome(pd.DataFrame(rows))
    assert isinstance(found, list)
    assert found[0].value.value == pytest.approx(0.005)
    assert found[0].value.count == 3
    assert found[1].value.value == pytest.approx(0.67)


@pytest.mark.parametrize(("hertz", "stage"), [(0.0, ("tangling", 3.0)), (2.0, ("untangling", 0.1))])
def test_a_run_is_about_the_last_stage_in_which_worms_turn(hertz: float, stage: tuple[str, float]) -> None:
    acts = [{"turns_between_reversals": 3.0}, {"turns_between_reversals": 0.1, "frequency_hz": hertz}]
    run: Any = SimpleNamespace(
        phases=[
            SimpleNamespace(index=k, type=name) for k, name in enumerate(("deposit", "wriggle", "wriggle", "lift"))
        ],
        scene={"phases": [{}, *acts, {}]},
    )
    assert blob_tangle._stages(run) == (1, *stage)


def test_findings_on_reversals_are_slopes_per_decade_within_a_stage() -> None:
    rows = [
        {
            blob_tangle.STAGE: stage, blob_tangle.TURNS: 10**x, blob_tangle.DECADES: x, blob_tangle.GAIN: 1.0 + x,
            blob_lift.OTHERS: sign * 0.2 * x + 0.01 * seed, blob_lift.CROSSINGS: 30.0, SEED: seed,
        }
        for stage, sign in (("tangling", 1), ("untangling", -1))
        for x in (-1.0, 0.0, 0.5)
        for seed in (1, 2, 3)
    ]  # fmt: skip
    found = {one.id: one.judge(pd.DataFrame(rows)) for one in blob_tangle.STUDY.findings}
    assert "+0.2 " in found["tangles"].ours
    assert "-0.2 " in found["untangles"].ours
    assert [str(found[name].verdict) for name in ("tangles", "untangles")] == ["found", "not found"]
    assert "+0 " in found["uncrosses"].ours  # γ = 0.1 alone


@pytest.mark.parametrize(("study", "phase"), [(blob_lift, "lift"), (blob_tangle, "lift"), (blob_topple, "release")])
def test_other_runs_are_left_out(study: Any, phase: str) -> None:
    run: Any = SimpleNamespace(path="run", phases=[SimpleNamespace(index=0, type="deposit")])
    with pytest.raises(InputError, match=f"has no phase {phase}; leave it out"):
        study.measure(run)
