"""Steps on several threads: the same bits for the same number, and the same physics for any."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import builds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.engine.interface import Saved
from dem.engine.links.engine import LinksEngine
from dem.engine.links.neighbours.search import FEW
from dem.engine.links.team import team as team_module
from dem.engine.links.team.shared import share

HERE, COUNT = Path(), 24


@pytest.fixture(scope="module")
def pile() -> Saved:
    """A pile, poured on one thread, that everything here goes on from."""
    return builds.pile(engine(), COUNT, settle=0.02).save(HERE)


def engine(threads: int = 1) -> LinksEngine:
    motors = builds.motor_law("halt")
    return builds.engine(gravity=9.81, radius=0.0234, dt=5e-5, account=True, motor_law=motors, threads=threads)


def shaken(pile: Saved, threads: int) -> LinksEngine:
    """The pile, about to be shaken on some threads."""
    made = engine(threads)
    made.load(pile, HERE)
    made.fixtures.shake(amplitude=1.2e-3, frequency=30.0)
    return made


def swing(made: LinksEngine, looks: int) -> None:
    for look in range(looks):
        made.motors.actuate(np.full((1, made.count, 2), math.pi / 2 - 0.5 * math.sin(look / 40)), 2e-4)
        made.advance(4)


def bits(made: LinksEngine) -> dict[str, bytes]:
    """Everything that a step goes on from."""
    arrays: dict[str, Any] = {**made._world.arrays, **made.motors.arrays}
    return {name: np.ascontiguousarray(array).tobytes() for name, array in arrays.items()}


def test_shares_are_all_that_there_is() -> None:
    for total in (0, 1, 5, 24, 1000):
        for threads in (1, 2, 3, 7):
            parts = [share(total, mine, threads) for mine in range(threads)]
            assert [parts[0][0], parts[-1][1]] == [0, total]
            assert all(one[1] == other[0] for one, other in pairwise(parts))
            assert max(stop - begin for begin, stop in parts) <= total // threads + 1


def test_one_thread_is_the_sequential_kernel() -> None:
    assert engine(1)._world.team is None
    assert engine(2)._world.team is not None


@pytest.mark.parametrize("threads", [2, 3])
def test_the_same_number_of_threads_gives_the_same_bits_however_steps_are_grouped(pile: Saved, threads: int) -> None:
    one, other = shaken(pile, threads), shaken(pile, threads)
    before = one._world.pairs.counts[2]
    one.advance(80)
    for steps in (1, 29, 50):
        other.advance(steps)
    assert one._world.pairs.counts[2] > before  # the search was among it
    assert bits(one) == bits(other)


def test_two_threads_find_the_forces_the_pairs_and_the_energies_of_one(pile: Saved) -> None:
    one, two = shaken(pile, 1), shaken(pile, 2)
    for steps in (1, 60):
        worlds = []
        for made in (one, two):
            made.advance(steps)
            worlds.append(made._world)
        first, second = worlds
        scale = np.abs(first.bodies.load).max()
        # To rounding after one step; a chaotic pile multiplies it as it goes on.
        assert np.abs(second.bodies.load - first.bodies.load).max() <= (1e-12 if steps == 1 else 1e-6) * scale
        for name in ("first", "second", "near"):
            count = first.pairs.counts[1 if name == "near" else 0]
            assert second.pairs.counts.tolist() == first.pairs.counts.tolist()
            np.testing.assert_array_equal(getattr(second.pairs, name)[:count], getattr(first.pairs, name)[:count])
        np.testing.assert_allclose(second.totals, first.totals, rtol=1e-6)
        assert first.totals[0] > 0
        # What smarticles feel they exert: on each other, and on the fixtures.
        felt, exerted = second.bodies.load[:, :3].sum(axis=0), second.ground.force.sum(axis=0)
        assert np.abs(felt + exerted).max() <= 1e-12 * scale


def test_a_checkpoint_on_two_threads_goes_on_with_the_same_bits(pile: Saved) -> None:
    made = shaken(pile, 2)
    made.advance(77)
    again = engine(2)
    again.load(made.save(HERE), HERE)
    for each in (made, again):
        each.advance(50)
        each.fixtures.stop()
        each.motors.articulate()
        swing(each, 20)
    assert bits(made) == bits(again)


def test_motors_do_the_work_on_two_threads_that_they_do_on_one(pile: Saved) -> None:
    sums = []
    for threads in (1, 2):
        made = engine(threads)
        made.load(pile, HERE)
        made.motors.articulate()
        swing(made, 30)
        sums.append((made.motors.work, made._world.totals[0]))
    assert sums[0][0] > 0
    np.testing.assert_allclose(sums[1], sums[0], rtol=1e-6)


def test_the_account_closes_on_two_threads(pile: Saved) -> None:
    made = shaken(pile, 2)
    made.advance(100)
    made.fixtures.stop()
    made.motors.articulate()
    swing(made, 50)
    state = made.state()
    stored = state.kinetic_energy + state.potential_energy(9.81, 0.0) + sum(made.account.elastic())
    given = made.account.given + made.motors.work
    assert made.account.dissipated > 0.03 * given
    assert abs(given - stored - made.account.dissipated) < 0.01 * given


def test_a_list_without_room_for_the_pairs_of_a_thread_grows(pile: Saved) -> None:
    made, plain = shaken(pile, 2), shaken(pile, 2)
    world = made._world
    there = int(world.pairs.counts[0]) + 1
    for name in ("first", "second", "slip", "used", "near", "touching", "nearest"):
        world.pairs = world.pairs._replace(**{name: getattr(world.pairs, name)[:there].copy()})
    names = ("lower", "upper", "first", "second", "slip", "used")
    world.cells = world.cells._replace(**{name: getattr(world.cells, name)[:there].copy() for name in names})
    for each in (made, plain):
        each._world.forget_places()
        each.advance(50)
    assert len(made._world.pairs.first) > there
    assert bits(made)["bodies.position"] == bits(plain)["bodies.position"]


def test_many_links_are_listed_in_another_order_and_are_the_same(pile: Saved) -> None:
    few, many = FEW // 3, FEW // 3 + 200
    random = np.random.default_rng(1)
    poses = builds.at(
        random.uniform([-0.06, -0.06, 0.01], [0.06, 0.06, 0.06], (many, 3)),
        list(Rotation.random(many, random_state=1)),
    )
    found = []
    for count, threads in ((few, 1), (many, 1), (many, 2)):
        made = builds.engine(gravity=9.81, dt=1e-9, account=True, threads=threads)
        made.add(builds.at(poses.positions[:count], list(poses.rotations[:count])))
        made.advance(1)
        pairs = made._world.pairs
        number = pairs.counts[0]
        found.append(np.stack([pairs.first[:number], pairs.second[:number]], axis=1))
    small, large, shared = found
    assert (np.diff(small[:, 0]) >= 0).all()
    assert not (np.diff(large[:, 0]) >= 0).all()
    np.testing.assert_array_equal(large, shared)
    among = large[(large < 3 * few).all(axis=1)]
    assert len(small) > few
    np.testing.assert_array_equal(np.unique(among, axis=0), np.unique(small, axis=0))
    assert len(np.unique(large, axis=0)) == len(large)


def test_a_thread_that_fails_is_not_waited_for(pile: Saved, monkeypatch: pytest.MonkeyPatch) -> None:
    made, kernel = shaken(pile, 2), team_module.advance_together
    made.advance(1)

    def fails(mine: int, *arguments: Any) -> Any:
        if mine:
            msg = "no memory"
            raise MemoryError(msg)
        return kernel(mine, *arguments)

    monkeypatch.setattr(team_module, "advance_together", fails)
    with pytest.raises(MemoryError):
        made.advance(10)
