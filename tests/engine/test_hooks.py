"""Hooks: what they read is what hangs on them, and nothing of them exists where no scene asks for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import boundary_cases
import cases
import h5py
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


@pytest.mark.parametrize("fidelity", ["draft"])
def test_a_hook_reads_the_weight_that_hangs_on_it(simulate: Simulate, scene_data: SceneData, fidelity: str) -> None:
    data = scene_data({"fidelity": fidelity, "hooks": {"upper_height_m": 0.02}})
    hung = simulate(boundary_cases.hang, data, settle=0.3, pull=0.1)
    lower, upper = hung["rest"]
    assert hung["speed"] < 1e-6
    assert upper == pytest.approx([0, 0, -hung["weight"]], abs=5e-3 * hung["weight"])
    assert np.abs(lower).max() == 0
    # Raised at constant speed it reads the same, and what hangs on it comes along.
    assert hung["moving"][1] == pytest.approx([0, 0, -hung["weight"]], abs=5e-3 * hung["weight"])
    assert hung["raised"] == pytest.approx(hung["expected"], rel=1e-9)
    assert hung["carried"] == pytest.approx(hung["expected"], rel=5e-3)


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


def test_the_pull_does_the_work_of_its_force(pulled: dict[str, np.ndarray]) -> None:
    pull = np.flatnonzero(pulled["phase"] == 2)[1:]
    steps = np.diff(pulled["hook_upper_z_m"])[pull - 1]
    work = -(pulled["hook_upper_force_N"][pull, 2] * steps).sum()
    recorded = pulled["container_work_J"][pull[-1]] - pulled["container_work_J"][pull[0] - 1]
    assert recorded == pytest.approx(work, rel=5e-3)
    assert work > 0
