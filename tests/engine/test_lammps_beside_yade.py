"""The engine lammps beside YADE: one law, one set of spheres, two codes that compute the same motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import beside_cases
import numpy as np
import pytest

from dem.engine.lammps.child import lammps_version
from dem.errors import RunError


@pytest.fixture(autouse=True)
def _lammps() -> None:
    try:
        lammps_version()
    except RunError as error:
        pytest.skip(f"needs LAMMPS (`make setup-mpi`, as .ci/run does): {error}")


def test_smarticles_thrown_at_the_floor_move_as_on_yade(
    simulate: Callable[..., dict[str, Any]], scene_data: Callable[..., dict[str, Any]]
) -> None:
    # Steps so short that what two schemes of integration make of an impact is the same.
    how = {"count": 3, "speed": 0.5, "steps": 900, "every": 50}
    fine = {"fidelity": {"base": "draft", "time_step_fraction": 0.15}}
    one, other = (
        simulate(beside_cases.thrown, scene_data({"engine": name, **fine}), **how) for name in ("yade", "lammps")
    )
    assert np.abs(one["vertices"][0] - other["vertices"][0]).max() < 1e-15
    apart = np.abs(one["vertices"] - other["vertices"]).max(axis=(1, 2, 3)) / one["diameter"]
    # They have met the floor, bounced and turned: they are far from where they would be in free fall.
    assert max(one["touches"]) > 2
    free = one["vertices"][0] - [0, 0, 0.5 * one["time"] + 9.81 * one["time"] ** 2 / 2]
    assert np.abs(one["vertices"][-1] - free).max() > 1.5 * one["diameter"]
    assert one["touches"] == other["touches"]
    # What is left are the two schemes: YADE turns bodies to first order.
    assert apart.max() < 0.05
    assert other["floor"] == pytest.approx(one["floor"], rel=1e-2)
    assert other["impulse"] == pytest.approx(one["impulse"], rel=1e-9)
