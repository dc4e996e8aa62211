"""Articulated smarticles: what splitting and welding keep, what hinges survive, and how motors meet loads."""

import math
from collections.abc import Callable
from pathlib import Path
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
STRONG = 1.0  # N m; a limit that no torque here comes near


@pytest.fixture
def data(scene_data: SceneData) -> SceneData:
    """Plain data of a scene whose smarticles have hinges."""
    return lambda changes=None: scene_data({"phases": ACTUATED, **(changes or {})})


def shape(aspect_ratio: float, fidelity: str = "draft", angles: Any = (90, 90), **motor: Any) -> dict[str, Any]:
    changes = {"smarticle.aspect_ratio": aspect_ratio, "smarticle.angles_deg": list(angles), "fidelity": fidelity}
    return {**changes, **{f"motor.{key}": value for key, value in motor.items()}}


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference over the length of a vector."""
    return float(np.abs(first - second).max() / np.linalg.norm(second))


def test_splitting_and_welding_in_flight_change_nothing(simulate: Simulate, data: SceneData) -> None:
    angles, case = [90, -15], articulated_cases.split_and_weld
    changes = shape(0.7, "reference", angles)
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


def test_welding_takes_the_energy_of_relative_motion_and_nothing_else(simulate: Simulate, data: SceneData) -> None:
    changes = shape(1.0, angles=(90, 20))
    done = simulate(articulated_cases.weld_in_motion, data(changes), targets_deg=(40, 70), spin=SPIN, time=0.16)
    before, after = done["before"], done["after"]
    # The barbs were on the move: else there were nothing to lose.
    assert done["relative"] > 1e-7 * before["e"]
    assert apart(after["p"], before["p"]) < ROUNDING
    assert apart(after["l"], before["l"]) < ROUNDING
    assert after["spheres"] == pytest.approx(before["spheres"], abs=1e-15)
    assert after["angles"] == pytest.approx(before["angles"], abs=1e-12)
    assert before["e"] - after["e"] == pytest.approx(done["relative"], abs=1e-13 * before["e"])
    # What is returned follows from YADE's angular velocities, which lag its angular momenta by half a step of free
    # spin: a relative ω dt, of which the energy of a rotation that hardly turns its axis keeps the square.
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
    """One pile left alone, split; split and left alone, split and welded."""
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


# -- a free smarticle --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "spin", "straight_in"),
    [
        (shape(1.0), (0, 0, 0), 0.6),  # faster, the vibration on the shafts halts the motors
        (shape(0.7, "standard", angles=(90, 20)), SPIN, 0.4),
    ],
)
def test_free_gait_keeps_momentum_and_its_hinges_together(
    simulate: Simulate, data: SceneData, changes: dict[str, Any], spin: Any, straight_in: float
) -> None:
    velocity = VELOCITY if any(spin) else (0, 0, 0)
    gait = simulate(articulated_cases.gait, data(changes), straight_in=straight_in, velocity=velocity, spin=spin)
    # Internal forces come in pairs at one point: nothing is left but rounding.
    assert gait["momentum"].max() < 1e-9 * gait["links_momentum"].max()
    assert gait["angular"].max() < 1e-9 * gait["links_angular"].max()
    assert gait["gap"].max() < 0.01
    assert gait["error"].max() < 0.01
    # It did move: a barb at π/2 / straight_in has at least this speed of its centre against the rest.
    assert np.ptp(gait["energy"]) > 1e-9
    assert np.abs(gait["angles"]).max() < 0.01


@pytest.mark.parametrize(("fidelity", "aspect_ratio"), [("draft", 1.0), ("reference", 0.7)])
def test_links_of_one_smarticle_never_touch(
    simulate: Simulate, data: SceneData, fidelity: str, aspect_ratio: float
) -> None:
    corners = [(105, 105), (-15, 105), (-15, -15), (105, -15), (90, 90)]
    changes = shape(aspect_ratio, fidelity, torque_limit_N_m=STRONG, speed_limit_rad_per_s=20.0)
    sweep = simulate(articulated_cases.sweep, data(changes), corners=corners, speed=20.0)
    assert sweep["touching"] == 0
    # The whole range was gone through, and a little more: barbs overshoot on their shafts.
    assert sweep["angles"].max(axis=0) == pytest.approx([106.5, 106.5], abs=1.6)
    assert sweep["angles"].min(axis=0) == pytest.approx([-16.5, -16.5], abs=1.6)
    assert sweep["gap"] < 0.01


# -- checkpoints -------------------------------------------------------------------------------------------------------


def test_motors_know_their_barbs_after_a_reload(simulate: Simulate, data: SceneData, tmp_path: Path) -> None:
    # YADE does not save the twist of a bond: read from it, every barb would be where it was at first, 30° away.
    angle = math.radians(60)
    found = simulate(articulated_cases.reloaded, data(shape(0.7)), angle=angle, spin=SPIN, folder=str(tmp_path))
    for before, after in zip(found["saved"], found["loaded"], strict=True):
        assert np.array_equal(before, after)
    assert found["loaded"][0] == pytest.approx(np.full((1, 2), angle), abs=0.01)
    assert found["state"] == pytest.approx(found["loaded"][0], abs=1e-3)
    # The next control update twists the shafts for where the barbs are: 3e-3 N m/rad, a hundredth of a radian at most.
    assert np.abs(found["after"]).max() < 3e-5


# -- motors ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("freed", [True, False])
def test_blocked_motor_halts_holds_and_comes_free(simulate: Simulate, data: SceneData, freed: bool) -> None:
    # All links are held while the motors straighten at 5 rad/s; then freed, or moved back by 0.003 rad. Torques are
    # YADE's, not those of the motors' control.
    blocked = simulate(articulated_cases.blocked, data(), freed=freed, back=0.003)
    limit, mark = blocked["limit"], blocked["mark"]
    commands, torques, halted = (blocked[key][:mark] for key in ("commands", "torques", "halted"))
    over = np.abs(torques) >= limit
    first = int(np.argmax(over.all(axis=1)))
    assert over[first].all()
    assert np.abs(torques[:first]).max() < limit
    # It stops within one period, and at no more than that period's advance above the limit.
    assert np.abs(torques).max() < limit + blocked["advance"]
    assert (commands[first:] == commands[first]).all()
    assert halted[first + 1 :].all()
    assert not halted[: first + 1].any()
    assert torques[first:] == pytest.approx(np.tile(torques[first], (mark - first, 1)), rel=1e-9)
    later = blocked["commands"][mark:]
    if freed:
        # Once free it goes all the way.
        assert later[-1] == pytest.approx(blocked["goal"], abs=1e-12)
        assert blocked["angles"] == pytest.approx(blocked["goal"], abs=0.02)
    else:
        # It gives way, although its torque stands against that at once: commands go up in the very first period.
        assert (later[0] > commands[-1]).all()
        assert later[-1] == pytest.approx(blocked["goal"], abs=1e-12)
        assert not blocked["halted"][mark:].any()
