"""Hooks: what they read is what hangs on them, and nothing of them exists where no scene asks for them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import cases
import fixture_cases
import h5py
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


@pytest.mark.parametrize("fidelity", ["draft"])
def test_a_hook_reads_the_weight_that_hangs_on_it(simulate: Simulate, scene_data: SceneData, fidelity: str) -> None:
    data = scene_data({"fidelity": fidelity, "hooks": {"upper_height_m": 0.02}})
    hung = simulate(fixture_cases.hang, data, settle=0.3, pull=0.1)
    lower, upper = hung["rest"]
    assert hung["speed"] < 1e-6
    assert upper == pytest.approx([0, 0, -hung["weight"]], abs=5e-3 * hung["weight"])
    assert np.abs(lower).max() == 0
    # Raised at constant speed it reads the same, and what hangs on it comes along.
    assert hung["moving"][1] == pytest.approx([0, 0, -hung["weight"]], abs=5e-3 * hung["weight"])
    assert hung["raised"] == pytest.approx(hung["expected"], rel=1e-9)
    assert hung["carried"] == pytest.approx(hung["expected"], rel=5e-3)


def test_floor_wall_and_hooks_together_carry_the_pile(simulate: Simulate, scene_data: SceneData) -> None:
    data = scene_data({"hooks": {"lower_height_m": 3e-3, "upper_height_m": 6e-3}})
    rest = simulate(fixture_cases.rest, data, count=20, settle=0.6)
    weight = rest["weight"]
    assert rest["speed"] < 1e-5
    total = rest["floor"] + rest["wall"] + rest["hooks"].sum(axis=0)
    assert total == pytest.approx([0, 0, -weight], abs=5e-3 * weight)
    # Each carries its share, or this would prove nothing.
    assert min(abs(force[2]) for force in (rest["floor"], rest["wall"], *rest["hooks"])) > 0.01 * weight


@pytest.fixture(scope="module")
def pulled(worker: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """Series of a small run whose upper hook is pulled out of the pile, after the container was shaken with it."""
    out = tmp_path_factory.mktemp("pulled") / "run"
    data = {
        "schema_version": 1,
        "seed": 2,
        "fidelity": "draft",
        "count": 12,
        "container": {"radius_m": 0.016},
        "hooks": {"lower_height_m": 3e-3, "upper_height_m": 6e-3},
        "recording": {"energy": True},
        "phases": [
            {"type": "deposit"},
            {"type": "shake", "duration_s": 0.11},
            {"type": "pull-hook", "speed_m_per_s": 0.1, "duration_s": 0.4},
        ],
    }
    answer = worker.submit(cases.run, data, str(out)).result(300)
    assert answer["error"] is None, answer
    with h5py.File(out / "series.h5") as file:
        for name in ("hook_upper_force_N", "hook_lower_force_N", "hook_upper_z_m"):
            assert file[name].attrs["unit"] == ("m" if name.endswith("_m") else "N")
        return {name: dataset[()] for name, dataset in file.items()}


def test_the_hook_moves_with_the_container_and_then_as_it_is_pulled(pulled: dict[str, np.ndarray]) -> None:
    z, floor, time = pulled["hook_upper_z_m"], pulled["container_z_m"], pulled["time_s"]
    before = pulled["phase"] < 2
    assert z[before] == pytest.approx(6e-3 + floor[before], abs=1e-12)
    assert np.ptp(z[pulled["phase"] == 1]) > 5e-4  # it was shaken
    pull = ~before
    expected = np.minimum(0.1 * (time[pull] - time[before][-1]), 2 * 0.0117)
    # Phases begin at a step near the sample; a pull ends at one.
    assert z[pull] - z[before][-1] == pytest.approx(expected, abs=3e-5)
    assert np.ptp(z[-10:]) == 0  # it arrived


def test_the_pull_does_the_work_of_its_force(pulled: dict[str, np.ndarray]) -> None:
    pull = np.flatnonzero(pulled["phase"] == 2)[1:]
    steps = np.diff(pulled["hook_upper_z_m"])[pull - 1]
    work = -(pulled["hook_upper_force_N"][pull, 2] * steps).sum()
    recorded = pulled["container_work_J"][pull[-1]] - pulled["container_work_J"][pull[0] - 1]
    assert recorded == pytest.approx(work, rel=5e-3)
    assert work > 0


def test_a_smarticle_that_both_hooks_hold_is_named(simulate: Simulate, scene_data: SceneData) -> None:
    hooks = {"lower_height_m": 0.02, "upper_height_m": 0.025}
    found = simulate(fixture_cases.bracket, scene_data({"count": 1, "hooks": hooks}), limit=6.1e-4)
    assert found["before"] == ()
    ((number, between, apart),) = found["held"]
    assert (number, between) == (0, ("the lower hook", "the upper hook"))
    assert apart == pytest.approx(found["raised"], rel=1e-9)
    # The slack between barbs and bars, and what two contacts give way.
    slack = 0.0117 - 1.218e-3 - 5.5e-3
    assert slack < apart < slack + 3 * 6.1e-4
    assert re.fullmatch(
        r"at t = .* s: 1 smarticle\(s\) \(0\): contacts more than .*; smarticle 0 is held by the lower hook and the "
        r"upper hook, which have moved apart by 0\.00\d+ m; set hooks\.upper_height_m and lower_height_m further apart "
        r"than w",
        found["said"],
    )
