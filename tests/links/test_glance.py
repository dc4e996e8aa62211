"""All extremes in one call: the same that a look at each smarticle finds, and nothing where one must look closely."""

import math
from typing import Any

import builds
import numpy as np
import pytest

from dem.engine.links.engine import PASSES, LinksEngine
from dem.setting.hooks import Cross

COUNT = 12


HOOKS = (Cross(height=0.003, length=0.02, side=1e-3), Cross(height=0.009, length=0.02, side=1e-3))


def shaken(*, hinged: bool = False, rows: int = 1, hooked: bool = False) -> LinksEngine:
    """A pile on the move."""
    made = builds.engine(
        gravity=9.81,
        radius=0.0234,
        dt=5e-5,
        motor_law=builds.motor_law() if hinged else None,
        made_of=builds.particle(rows=rows),
        hooks=HOOKS if hooked else None,
    )
    builds.pile(made, COUNT, settle=0.1)
    made.boundaries.shake(amplitude=0.2e-3, frequency=30.0)
    made.advance(120)
    if hinged:
        made.motors.articulate()
        made.motors.actuate(np.full((1, COUNT, 2), 1.4), 2e-4)
        made.advance(4)
    return made


@pytest.mark.parametrize("kind", [{}, {"hinged": True}, {"rows": 2}, {"hooked": True}])
def test_it_finds_what_a_look_at_each_finds(kind: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dem.engine.links.engine.HOLDS", 1.0)  # contacts at these thin hooks are deep
    made = shaken(**kind)
    made.overlaps(1.0)  # forget how deep they were as they were poured, which does not know of hooks
    state = made.state()
    found = made.extremes(state)
    assert found is not None
    assert made.extremes(state) == found  # nothing of the simulation is changed
    overlaps = made.overlaps(1.0)
    assert found.deepest == overlaps.deepest > 0
    assert found.elastic_energy == pytest.approx(overlaps.elastic_energy, rel=1e-12)
    assert found.elastic_energy > 0
    assert found.fastest == pytest.approx(np.linalg.norm(state.link_velocities, axis=-1).max(), rel=1e-14)
    # The first and the last of each straight row of the chain lie at the ends of the axes.
    points = state.spheres(made.particle).reshape(-1, 3)
    assert found.lowest == pytest.approx(points[:, 2].min(), abs=1e-9)
    assert found.highest == pytest.approx(points[:, 2].max(), abs=1e-9)
    assert found.widest == pytest.approx(np.hypot(points[:, 0], points[:, 1]).max(), abs=1e-9)
    assert found.gap == 0.0


def test_one_that_may_have_passed_between_two_looks_is_to_be_looked_at() -> None:
    made = shaken()
    state = made.state()
    made._world.bodies.deepest[COUNT // 2] = 1.01 * PASSES
    assert made.extremes(state) is None
    # It was not forgotten for that: the close look still tells who.
    assert made.overlaps(0.5 * builds.DIAMETER).deep.tolist() == [k == COUNT // 2 for k in range(COUNT)]
    assert made.extremes(state) is not None


@pytest.mark.parametrize("where", [0, COUNT - 1])
def test_a_speed_that_is_no_number_is_told(where: int) -> None:
    made = shaken()
    state = made.state()
    state.link_velocities[where, 1, 2] = math.nan
    found = made.extremes(state)
    assert found is not None
    assert math.isnan(found.fastest)


def test_a_depth_that_is_no_number_is_told() -> None:
    made = shaken()
    state = made.state()
    made._world.bodies.deepest[0] = math.nan
    found = made.extremes(state)
    assert found is None or math.isnan(found.fastest)


def test_nobody_is_within_all_limits() -> None:
    made = builds.engine(gravity=9.81)
    found = made.extremes(made.state())
    assert found is not None
    assert (found.fastest, found.deepest, found.elastic_energy) == (0.0, 0.0, 0.0)
    assert found.lowest == math.inf
