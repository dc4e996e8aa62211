"""LAMMPS under mpirun, where it is installed."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from dem.engine.cores import usable_cores
from dem.engine.demand import contact_law_of
from dem.engine.lammps.child import lammps_version
from dem.engine.lammps.engine import LammpsEngine
from dem.errors import RunError
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from dem.setting.container import Cylinder


@pytest.fixture(scope="session", autouse=True)
def _installed() -> None:
    try:
        lammps_version()
    except RunError as error:
        pytest.skip(f"tests of engine: lammps need it (`make setup-mpi`, as .ci/run does): {error}")
    if usable_cores() < 2:
        pytest.skip("mpirun -np 2 needs two cores")


@pytest.fixture
def build() -> Iterator[Callable[..., LammpsEngine]]:
    """Builds engines of scenes, by default on two ranks, that end with the test."""
    built: list[LammpsEngine] = []

    def make(scene: Scene, *, ranks: int = 2, **instead: Any) -> LammpsEngine:
        made = {
            "particle": scene.body,
            "cylinder": Cylinder(radius=scene.container.radius_m, height=scene.cylinder.height, facets=64),
            "law": contact_law_of(scene),
            "gravity": scene.gravity_m_per_s2,
            "time_step": time_step(scene),
            "ranks": ranks,
        }
        built.append(LammpsEngine(**(made | instead)))
        return built[-1]

    yield make
    for engine in built:
        engine.child.close()
