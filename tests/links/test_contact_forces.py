"""Forces at contacts as they are told, against those that the next step moves smarticles with."""

from collections.abc import Callable
from pathlib import Path

import builds
import numpy as np
import pytest

from dem.body.forces import BOUNDARIES, NONE, ContactForces
from dem.engine.links.engine import LinksEngine
from dem.plan.steps import time_steps
from dem.run.build import build_engine
from dem.scene.reading import load_scene
from smarticles.starters import starter

NO_TIME = 1e-13  # s; in such a step nothing moves and no spring is stretched
FEW = ("count=12", "phases.0.per_layer=6")

Holds = Callable[[LinksEngine, ContactForces], bool]


def touched(*parts: str) -> Holds:
    """Whether all of some boundaries, and two smarticles, carry something."""
    return lambda _, found: {NONE, *map(BOUNDARIES.index, parts)} <= set(found.boundaries.tolist())


CASES: dict[str, tuple[str, tuple[str, ...], Holds]] = {
    "shaken in a cylinder": ("shaken", FEW, touched("floor", "wall")),
    "swinging barbs": ("actuated", FEW, lambda made, found: made.motors.articulated and touched("floor")(made, found)),
    "hooks": ("hook", FEW, touched("floor", "wall", "lower hook", "upper hook")),
    "tiers": ("casting", ("count=24",), touched("wall")),
    "a lifted wall": (
        "collapse",
        ("count=40", "phases.1.duration_s=0.1", "phases.3.speed_m_per_s=0.02"),
        lambda made, found: 1e-3 < made.boundaries.wall_bottom < 1 and touched("floor", "wall")(made, found),
    ),
    "a channel": ("chain", ("count=4",), touched("channel's lower wall", "channel's upper wall")),
}


def simulated(folder: Path, name: str, overrides: tuple[str, ...], holds: Holds) -> tuple[LinksEngine, ContactForces]:
    """A starter's simulation at an instant at which something is so."""
    file = folder / "scene.yaml"
    file.write_text(starter(name), encoding="utf-8")
    scene = load_scene(file, overrides)
    steps = time_steps(scene)
    engine = build_engine(scene, min(steps))
    assert isinstance(engine, LinksEngine)
    for index, phase in enumerate(scene.phases):
        stage = phase.begin(scene, index)
        engine.set_time_step(steps[index])
        while wait := stage.proceed(engine):
            target = engine.steps + max(1, round(wait / engine.time_step))
            while engine.steps < target:
                engine.advance(min(40, target - engine.steps))
                if engine.count == scene.count and holds(engine, engine.contact_forces()):
                    engine.advance(1)  # motors have looked now, and do not at the next step
                    return engine, engine.contact_forces()
    pytest.fail(f"{name}: never so")


@pytest.mark.parametrize("case", CASES)
def test_they_are_what_moves_smarticles_and_what_boundaries_feel(tmp_path: Path, case: str) -> None:
    engine, _ = simulated(tmp_path, *CASES[case])
    world = engine._world
    engine.set_time_step(NO_TIME)
    found = engine.contact_forces()
    engine.advance(1)
    on_each, between = np.zeros((engine.count, 3)), found.boundaries == NONE
    np.add.at(on_each, found.smarticles[:, 0], found.forces)
    np.subtract.at(on_each, found.smarticles[between, 1], found.forces[between])
    felt = np.zeros((len(BOUNDARIES), 3))
    np.subtract.at(felt, found.boundaries[~between], found.forces[~between])
    loads = world.bodies.load
    largest = np.abs(found.forces).max()
    assert largest > 0
    pulled = [0, engine.count - 1] if engine.strings.tied else []  # by what is no contact
    np.testing.assert_allclose(np.delete(on_each, pulled, 0), np.delete(loads[:, :3], pulled, 0), atol=1e-9 * largest)
    np.testing.assert_allclose(felt, world.ground.force, atol=1e-9 * largest)


def test_nothing_is_changed_by_asking(tmp_path: Path) -> None:
    engine, _ = simulated(tmp_path, *CASES["shaken in a cylinder"])
    before = {name: np.array(array) for name, array in engine._world.arrays.items()}
    engine.contact_forces()
    for name, array in engine._world.arrays.items():
        np.testing.assert_array_equal(array, before[name], err_msg=name)


def test_friction_of_a_link_that_slides_is_coulombs() -> None:
    made = builds.engine(gravity=9.81)
    made.add(builds.at([0.0, 0.0, builds.DIAMETER / 2]))
    made._world.posed().velocity[0] = 0.0, 0.3, 0.0
    made.advance(100)
    for _ in range(20):
        made.advance(7)
        found = made.contact_forces()
        assert found.normal.sum() > 0.3 * made.particle.mass * 9.81
        np.testing.assert_allclose(found.tangential, builds.LAW.wall_friction * found.normal, rtol=1e-9)
    assert made.state().velocities[0, 1] > 0.1  # it slides on
