"""The stable time step: modes that it knows are stable just below it, and blow up above."""

from dataclasses import replace

import builds
import numpy as np
import pytest

from dem.engine.links.stable_step import SHAPES, WIDEST, links_stable_time_step


def test_it_goes_with_the_root_of_the_stiffness_and_shrinks_with_damping() -> None:
    p = builds.particle()
    soft = links_stable_time_step(p, builds.ELASTIC)
    hard = links_stable_time_step(p, replace(builds.ELASTIC, normal_stiffness=2000.0, tangential_stiffness=1640.0))
    assert soft / hard == pytest.approx(2.0)
    assert links_stable_time_step(p, replace(builds.ELASTIC, normal_damping=0.2, wall_damping=0.2)) < soft
    # Free barbs are lighter at their tips than the same shapes while they are welded.
    welded = [builds.particle(angles=(angle, angle)) for angle in np.linspace(0.0, WIDEST, SHAPES)]
    least = min(links_stable_time_step(each, builds.ELASTIC) for each in welded)
    assert links_stable_time_step(p, builds.ELASTIC, articulated=True) < 0.95 * least
    assert links_stable_time_step(p, builds.ELASTIC, strings=[(1e6, 0.0)]) < soft


def test_a_bar_on_the_floor_is_stable_below_its_own_limit_and_not_above() -> None:
    # Two springs on the whole mass: ω² = 2k/m, stable while ω dt < 2; a nudge grows beyond.
    p = builds.particle(aspect=0.0)
    limit = 2 / np.sqrt(2 * 500.0 / p.boxes.mass)
    assert links_stable_time_step(p, builds.ELASTIC) < limit
    kinetic = []
    for share in (0.98, 1.02):
        made = builds.engine(law=builds.ELASTIC, gravity=9.81, dt=share * limit, made_of=p)
        made.add(builds.at([0, 0, builds.DIAMETER / 2 - p.boxes.mass * 9.81 / 1000.0 * 1.01]))
        made.advance(400)
        kinetic.append(made.state().kinetic_energy)
    assert kinetic[1] > 100 * kinetic[0]
