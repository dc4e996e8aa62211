"""The barrier: smooth, linear for ordinary contacts, and never passed, whatever the speed or the load."""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import builds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes, Particle, SphereChain
from dem.engine.links.contact import barrier
from dem.engine.links.contact.barrier import FINEST, LAST, LINEAR, Step
from dem.engine.links.stepping import MOST
from dem.errors import RunError
from dem.record.series import read_series
from dem.run.run import run_scene
from dem.scene.reading import parse_scene

ROOM = 1e-3
resolve, stretch, ticks_for = (
    builds.callable_from_python(part) for part in (barrier.resolve, barrier.stretch, barrier.ticks_for)
)


def thin(width: float = 0.5e-3) -> Particle:
    """A bar half a millimetre thick."""
    boxes = Boxes(
        middle_length=builds.W, barb_length=0.0, thickness_normal=width, thickness_in_plane=width,
        density=builds.DENSITY,
    )  # fmt: skip
    return Particle(boxes, SphereChain(rows=1, diameter=width, pitch=0.35 * width))


def test_ordinary_contacts_are_linear_to_the_bit() -> None:
    for depth in (0.0, 1e-6, 0.1 * ROOM, LINEAR * ROOM):
        assert stretch(depth, ROOM) == (depth, 1.0, 1.0)


def test_it_has_two_continuous_derivatives_and_grows_without_bound() -> None:
    depths = np.linspace(0.2, LINEAR + 0.97 * LAST * (1 - LINEAR), 4001) * ROOM
    u, slope, hardening = np.array([stretch(depth, ROOM) for depth in depths]).T
    step = depths[1] - depths[0]
    np.testing.assert_allclose(np.gradient(u, step)[1:-1], slope[1:-1], rtol=1e-3)
    curvature = np.gradient(slope, step)
    np.testing.assert_allclose((hardening**2 - slope**2)[1:-1], (u * curvature)[1:-1], rtol=1e-3, atol=0.01)
    assert abs(np.diff(curvature[depths < 0.3 * ROOM])).max() < 0.01 / ROOM  # no jump where it begins
    assert (np.diff(slope) >= 0).all()
    last = LINEAR + LAST * (1 - LINEAR)
    assert stretch(last * ROOM, ROOM)[0] > 15 * ROOM
    assert stretch(1.5 * ROOM, ROOM)[0] > stretch(last * ROOM, ROOM)[0]


def test_sub_steps_begin_at_multiples_of_their_length_and_fill_the_step() -> None:
    needs = itertools.cycle([3.0, 1.0, 900.0, 1.2, 5e4, 1.0])
    tick = count = 0
    while tick < FINEST:
        ticks = ticks_for(next(needs), tick)
        assert tick % ticks == 0
        tick, count = tick + ticks, count + 1
    assert tick == FINEST
    assert count > 1


def test_contacts_ask_for_sub_steps_only_beyond_the_linear_range() -> None:
    need = np.ones(1)
    step = Step(1e-4, 1e-4, need)
    for depth, closing in ((0.1 * ROOM, 0.5), (0.24 * ROOM, -3.0)):
        resolve(step, depth, ROOM, closing)
        assert need[0] == 1.0
    resolve(step, 0.6 * ROOM, ROOM, 0.0)
    assert 2.0 < need[0] < FINEST


@pytest.mark.parametrize("spin", [0.0, 60.0])
@pytest.mark.parametrize("stiffness", [250.0, 1000.0])
def test_links_do_not_pass_each_other_at_ten_metres_per_second(spin: float, stiffness: float) -> None:
    law = replace(builds.ELASTIC, normal_stiffness=stiffness, tangential_stiffness=stiffness)
    made = builds.engine(law=law, dt=5e-5, made_of=thin())
    # Bars at right angles, of which one falls onto the middle of the other.
    across = Rotation.from_euler("z", 90, degrees=True)
    made.add(builds.at([[0.0, 0.0, 0.1], [0.0, 0.0, 0.102]], [Rotation.identity(), across]))
    made._world.bodies.velocity[1, 2] = -10.0
    made._world.bodies.momentum[1, 0] = spin * made.particle.boxes.inertia[0]
    energy = made.state().kinetic_energy
    for _ in range(40):
        made.advance(1)
        upper, lower = made.state().positions[1, 2], made.state().positions[0, 2]
        assert upper > lower  # nothing has passed
    assert made.ledger.elastic()[0] == 0.0
    assert made.state().kinetic_energy == pytest.approx(energy, rel=0.01)
    assert made.state().velocities[0, 2] < -1.0  # they have met
    assert made._world.totals[MOST] > 1.0


def test_a_floor_bears_a_load_a_hundred_times_what_its_linear_spring_could() -> None:
    made = builds.engine(gravity=0.0, dt=2e-5, made_of=builds.particle(aspect=0.0))
    radius = made.particle.radius
    made.add(builds.at([0, 0, radius]))
    # Both ends together could take kn times the diameter; the axis stays above the floor all the same.
    made._world.gravity = 100 * 500.0 * 2 * radius / made.particle.boxes.mass
    lowest = math.inf
    for _ in range(200):
        made.advance(1)
        lowest = min(lowest, float(made.state().vertices[..., 2].min()))
    assert 0.0 < lowest < radius


def test_a_hook_pulls_without_energy_from_nowhere(tmp_path: Path) -> None:
    # Before the barrier a strung smarticle snapped through: 58 % of the hook's work, and the run ended as done.
    data = {
        "schema_version": 1, "seed": 1, "engine": "links", "fidelity": "draft", "count": 40, "hooks": {},
        "phases": [{"type": "deposit"}, {"type": "relax", "duration_s": 0.2}, {"type": "pull-hook"}],
        "recording": {"energy": True, "dissipation_interval_s": 0.004},
    }  # fmt: skip
    out = tmp_path / "run"
    try:
        run_scene(parse_scene(data, source="scene"), out, command="", resume=False)
    except RunError as error:
        assert "is held by the lower hook and the upper hook, which have moved apart" in str(error)  # noqa: PT017
    series = read_series(out)
    residual, dissipated = series["energy_residual_J"], series["dissipated_energy_J"]
    assert dissipated[-1] > 5e-4
    # The ledger itself is good to 1 to 2 % in so small a pile.
    assert np.abs(residual).max() < 0.04 * dissipated[-1]
