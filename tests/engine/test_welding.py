"""Splitting a smarticle into hinged links and welding it again: nothing is lost but what must be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import articulated_cases
import cases
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
ROUNDING = 1e-13  # relative; sums of a dozen terms, in which double precision leaves 1e-15
VELOCITY, SPIN = (0.1, -0.2, 0.3), (20.0, 35.0, -15.0)
ACTUATED = [{"type": "deposit"}, {"type": "shape-change"}]

SHAPES = [
    (0.7, [20, 100], "draft"),
    (0.7, [90, -15], "reference"),
]


@pytest.fixture
def data(scene_data: SceneData) -> SceneData:
    """Plain data of a scene whose smarticles have hinges."""
    return lambda changes=None: scene_data({"phases": ACTUATED, **(changes or {})})


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference over the length of a vector."""
    return float(np.abs(first - second).max() / np.linalg.norm(second))


@pytest.mark.parametrize(("aspect_ratio", "angles", "fidelity"), SHAPES)
def test_splitting_and_welding_in_flight_change_nothing(
    simulate: Simulate, data: SceneData, aspect_ratio: float, angles: list[float], fidelity: str
) -> None:
    changes = {"smarticle.aspect_ratio": aspect_ratio, "smarticle.angles_deg": angles, "fidelity": fidelity}
    case = articulated_cases.split_and_weld
    done = simulate(case, data(changes), velocity=VELOCITY, spin=SPIN, steps=40)
    before = done["before"]
    assert np.degrees(before["angles"]) == pytest.approx(np.array([angles]), abs=1e-9)
    for stage in ("split", "welded", "again"):
        now = done[stage]
        assert apart(now["p"], before["p"]) < ROUNDING
        assert apart(now["l"], before["l"]) < ROUNDING
        # No link moves against another, so welding has nothing to take.
        assert now["e"] == pytest.approx(before["e"], rel=ROUNDING)
        assert now["e_state"] == pytest.approx(now["e"], rel=ROUNDING)
        for places in ("spheres", "vertices"):
            assert now[places] == pytest.approx(before[places], abs=1e-15)
        assert now["angles"] == pytest.approx(before["angles"], abs=1e-12)
        # Contact laws read the spheres' velocities. A spin that YADE stores belongs to half a step ago: ω dt of it.
        late = np.linalg.norm(SPIN) * done["dt"] * np.linalg.norm(SPIN) * done["size"]
        assert now["sphere_velocities"] == pytest.approx(before["sphere_velocities"], abs=late)
    assert abs(done["loss"]) < ROUNDING * before["e"]
    boxes = cases.scene_of(data(changes)).smarticle.boxes
    assert done["moments"] == pytest.approx(np.sort(boxes.inertia), rel=1e-12)


@pytest.mark.parametrize(
    ("aspect_ratio", "angles", "spin"),
    [(1.0, [90, 20], SPIN)],
)
def test_welding_takes_the_energy_of_relative_motion_and_nothing_else(
    simulate: Simulate, data: SceneData, aspect_ratio: float, angles: list[float], spin: Any
) -> None:
    changes = {"smarticle.aspect_ratio": aspect_ratio, "smarticle.angles_deg": angles}
    case = articulated_cases.weld_in_motion
    done = simulate(case, data(changes), targets_deg=(40, 70), spin=spin, time=0.16)
    before, after = done["before"], done["after"]
    # The barbs were on the move: else there were nothing to lose.
    assert done["relative"] > 1e-7 * before["e"]
    assert apart(after["p"], before["p"]) < ROUNDING
    assert apart(after["l"], before["l"]) < ROUNDING
    assert after["spheres"] == pytest.approx(before["spheres"], abs=1e-15)
    assert after["angles"] == pytest.approx(before["angles"], abs=1e-12)
    assert before["e"] - after["e"] == pytest.approx(done["relative"], abs=1e-13 * before["e"])
    # What is returned is told by YADE's angular velocities, which lag its angular momenta by half a step of free spin:
    # a relative ω dt, of which the energy of a rotation that hardly turns its axis keeps the square.
    assert done["loss"] == pytest.approx(done["relative"], abs=2e-7 * before["e"])
    # The inertia of the boxes at these angles, but for hinges that are open by the gap.
    assert np.degrees(after["angles"][0]) == pytest.approx([40, 70], abs=0.5)
    lever = cases.scene_of(data(changes)).smarticle.boxes.lengths.min() / 2
    assert done["tensor"] == pytest.approx(done["exact"], rel=4 * done["gap"] / lever + 1e-12)
    assert done["mass"] == pytest.approx(done["exact_mass"], rel=1e-12)
    # Spheres have the velocities of one body, for the contact laws of the next step; they had those of three.
    fastest = np.abs(done["field"]).max()
    assert after["sphere_velocities"] == pytest.approx(done["field"], abs=1e-9 * fastest)
    assert np.abs(before["sphere_velocities"] - done["field"]).max() > 1e-3 * fastest
    # And it stays as it was welded.
    assert done["later"]["angles"] == pytest.approx(after["angles"], abs=1e-12)
    assert apart(done["later"]["l"], before["l"]) < ROUNDING * 200


@pytest.fixture(scope="module")
def piles(worker: Any) -> dict[str, dict[str, Any]]:
    """The same pile left alone, split; split and left alone, split and welded."""
    data = {"schema_version": 1, "seed": 1, "count": 6, "fidelity": "draft", "phases": ACTUATED}
    return {
        change: worker.submit(articulated_cases.resting_pile, data, count=6, settle=0.8, change=change).result(300)
        for change in ("none", "split", "split-rest", "weld")
    }


@pytest.mark.parametrize(("change", "answer", "tolerance"), [("split", "none", 1e-5), ("weld", "split-rest", 5e-3)])
def test_contacts_survive(piles: dict[str, dict[str, Any]], change: str, answer: str, tolerance: float) -> None:
    changed, alone = piles[change], piles[answer]
    assert len(changed["before"]) > 20
    assert changed["kept"].keys() == changed["before"].keys()
    for pair, force in changed["before"].items():
        assert (changed["kept"][pair] == force).all()
    # One step later, against the pile that was left alone. A split pile is at rest, nearly; barbs of the pile that is
    # welded still quiver on their shafts, by parts in a thousand of the weight, until they are welded.
    assert changed["after"].keys() == alone["after"].keys()
    for pair, force in alone["after"].items():
        assert changed["after"][pair] == pytest.approx(force, abs=tolerance * changed["weight"])
    assert max(np.abs(force).max() for force in alone["after"].values()) > 0.2 * changed["weight"]
    assert changed["moved"] < 1e-15
