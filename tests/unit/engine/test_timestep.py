"""Damping from restitution, and the stable time step against a scheme that is iterated until it blows up."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dem.engine.yade.kind import contact_law_of
from dem.engine.yade.stable_step import CONTACTS_AT_A_TIP, stable_time_step
from dem.errors import InputError
from dem.physics.contact import damping_ratio, restitution_of, typical_effective_mass
from dem.plan.steps import time_step, time_steps
from dem.scene.scene import Scene

MakeScene = Callable[..., Scene]


def rebound(zeta: float) -> float:
    """x'' = -x - 2ζx' from first touch until the force would pull, integrated: no closed form."""

    def pull(_: float, y: np.ndarray) -> float:
        return y[0] + 2 * zeta * y[1]

    pull.terminal, pull.direction = True, -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda _, y: [y[1], -y[0] - 2 * zeta * y[1]], (0, 100), [0.0, 1.0], events=pull, rtol=1e-10, atol=1e-12
    )
    return float(-solution.y_events[0][0][1])


@pytest.mark.parametrize("zeta", [1e-3, 0.1, 0.5, 0.70711, 0.95, 1.0, 1.5, 3.0])
def test_restitution_of_a_contact_that_never_pulls(zeta: float) -> None:
    assert restitution_of(zeta) == pytest.approx(rebound(zeta), rel=1e-6)


@given(st.floats(0.01, 0.9999))
def test_damping_ratio_inverts_it(restitution: float) -> None:
    assert restitution_of(damping_ratio(restitution)) == pytest.approx(restitution, rel=1e-9)


def test_less_damping_rebounds_faster() -> None:
    ratios = [damping_ratio(restitution) for restitution in (0.01, 0.2, 0.5, 0.9, 1.0)]
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[2] == pytest.approx(0.2565, abs=5e-3)  # a contact that pulled would need 0.2155


def test_elastic_contact_has_no_damping(make_scene: MakeScene) -> None:
    assert damping_ratio(1.0) == 0
    law = contact_law_of(make_scene({"contact.restitution": 1}))
    assert (law.normal_damping, law.wall_damping) == (0, 0)


def test_typical_mass_by_random_pushes(make_scene: MakeScene) -> None:
    particle = make_scene().particle
    pushes = np.random.default_rng(4).normal(size=(4000, 3))
    pushes /= np.linalg.norm(pushes, axis=1)[:, None]
    arms = np.cross(particle.centres[:, None], pushes[None])
    mobility = 1 / particle.boxes.mass + (arms**2 / particle.boxes.inertia).sum(axis=-1)
    # 4000 directions for each of some twenty spheres: the mean scatters by 0.5 %.
    assert typical_effective_mass(particle) == pytest.approx(1 / mobility.mean(), rel=0.02)
    assert typical_effective_mass(particle) < 0.7 * particle.boxes.mass


def test_law_carries_the_scenes_numbers(make_scene: MakeScene) -> None:
    scene = make_scene(
        {
            "contact.friction_smarticle": 0.3,
            "contact.friction_wall": 0.2,
            "contact.tangential_stiffness_ratio": 0.5,
            "contact.tangential_damping_ratio": 0.25,
            "contact.restitution": 0.4,
            "fidelity": {"stiffness_N_per_m": 800.0},
        }
    )
    law, mass = contact_law_of(scene), typical_effective_mass(scene.particle)
    assert (law.normal_stiffness, law.tangential_stiffness) == (800, 400)
    assert (law.friction, law.wall_friction, law.tangential_damping) == (0.3, 0.2, 0.25)
    # The same damping ratio in both: against the wall one typical mass moves, between smarticles half of it.
    for damping, moved in ((law.wall_damping, mass), (law.normal_damping, mass / 2)):
        assert damping / (2 * math.sqrt(800 * moved)) == pytest.approx(damping_ratio(0.4), rel=1e-12)


def limit_by_iteration(stiffness: float, damping: float, mass: float) -> float:
    """Largest stable step of leapfrog with the dashpot's velocity half a step late: bisection on blowing up."""

    def grows(dt: float) -> bool:
        x, v = 1.0, 0.0
        for _ in range(4000):
            v += dt * (-stiffness * x - damping * v) / mass
            x += dt * v
            if abs(x) > 1e3:
                return True
        return False

    low, high = 0.0, 4 * math.sqrt(mass / stiffness)
    for _ in range(16):
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


def limit_of_a_flat_pile(scene: Scene, layers: int, *, rolling: bool = False) -> float:
    """The same for smarticles lying flat on each other, on the floor: eigenvalues of the damped leapfrog map.

    They move up and down, or all roll about the axis about which they have the least inertia.
    """
    particle, law = scene.particle, contact_law_of(scene)
    springs, neighbour, stiffness, share = len(particle.centres) / particle.boxes.mass, -1, law.normal_stiffness, 1.0
    if rolling:
        # Surfaces that face each other part where both roll in the same sense.
        tops = particle.centres[:, 2] + particle.radius
        springs, neighbour = (tops**2).sum() / particle.boxes.inertia[:2].min(), 1
        stiffness, share = law.tangential_stiffness, law.tangential_damping
    spring, dashpot = np.zeros((layers, layers)), np.zeros((layers, layers))
    for k in range(layers):
        pair = np.zeros(layers)
        pair[k] = 1
        if k:
            pair[k - 1] = neighbour
        spring += springs * stiffness * np.outer(pair, pair)
        dashpot += springs * share * (law.normal_damping if k else law.wall_damping) * np.outer(pair, pair)
    one, none = np.eye(layers), np.zeros((layers, layers))

    def grows(dt: float) -> bool:
        velocity = np.hstack([-dt * spring, one - dt * dashpot])
        step = np.vstack([np.hstack([one, none]) + dt * velocity, velocity])
        return bool(np.abs(np.linalg.eigvals(step)).max() > 1 + 1e-9)

    low, high = 0.0, 4 / math.sqrt(springs * stiffness)
    for _ in range(14):
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


CHANGES: list[dict[str, object]] = [
    {},
    {"fidelity": "standard"},
    {"fidelity": "reference", "smarticle.aspect_ratio": 2},
    {"contact.restitution": 1, "smarticle.aspect_ratio": 0},
    {"contact.restitution": 0.05, "smarticle.aspect_ratio": 1},
    {"smarticle.aspect_ratio": 0.3, "fidelity": {"pitch": 1.4}},
    {"smarticle.aspect_ratio": 0.1},
    {"fidelity": "reference", "smarticle.aspect_ratio": 0},
]


@pytest.mark.parametrize("changes", CHANGES)
def test_stable_step_equals_the_limit_of_the_iterated_schemes(
    make_scene: MakeScene, changes: dict[str, object]
) -> None:
    scene = make_scene(changes)
    particle, law = scene.particle, contact_law_of(scene)
    light, contacts = particle.smallest_effective_mass, CONTACTS_AT_A_TIP
    limits = [
        limit_by_iteration(contacts * law.normal_stiffness, contacts * damping, moved)
        for moved, damping in ((light / 2, law.normal_damping), (light, law.wall_damping))
    ]
    limits += [limit_of_a_flat_pile(scene, layers=24, rolling=rolling) for rolling in (False, True)]
    # 4000 steps see growth of 0.2 % a step; 24 layers come within 0.5 % of the endless pile, from above.
    assert stable_time_step(particle, law) == pytest.approx(min(limits), rel=0.01)


@pytest.mark.parametrize("layers", [1, 2, 3, 10])
@pytest.mark.parametrize("changes", CHANGES)
def test_stable_step_is_stable_for_piles_lying_flat(
    make_scene: MakeScene, changes: dict[str, object], layers: int
) -> None:
    scene = make_scene(changes)
    assert stable_time_step(scene.particle, contact_law_of(scene)) <= limit_of_a_flat_pile(scene, layers) * (1 + 1e-3)


def test_softer_or_heavier_allows_larger_steps(make_scene: MakeScene) -> None:
    scene = make_scene({"contact.restitution": 1})
    law = contact_law_of(scene)
    softer = dataclasses.replace(law, normal_stiffness=law.normal_stiffness / 4)
    assert stable_time_step(scene.particle, softer) == pytest.approx(2 * stable_time_step(scene.particle, law))


@pytest.mark.parametrize("fidelity", ["draft", "standard", "reference"])
@pytest.mark.parametrize("series", [0.004, 0.0033, 1e-5])
def test_time_step_divides_the_recording_intervals(make_scene: MakeScene, fidelity: str, series: float) -> None:
    changes = {"fidelity": fidelity, "recording": {"series_interval_s": series}}
    changes["recording"] |= {"frame_interval_s": 10 * series, "checkpoint_interval_s": None}
    scene = make_scene(changes)
    dt = time_step(scene)
    steps = series / dt
    assert steps == pytest.approx(round(steps), abs=1e-9)
    wanted = scene.fidelity.time_step_fraction * stable_time_step(scene.particle, contact_law_of(scene))
    assert dt <= min(wanted, series) * (1 + 1e-9)
    if series > 10 * wanted:
        assert dt > 0.9 * wanted  # no smaller than needed


def test_given_time_step_is_taken_exactly_where_it_divides(make_scene: MakeScene) -> None:
    assert time_step(make_scene({"fidelity": {"time_step_s": 1e-5}})) == pytest.approx(1e-5, rel=1e-12)
    assert time_step(make_scene({"fidelity": {"time_step_s": 3e-5}})) == pytest.approx(0.004 / 134, rel=1e-12)


def test_given_time_step_above_the_stable_one_is_refused_with_both(make_scene: MakeScene) -> None:
    scene = make_scene({"fidelity": {"time_step_s": 0.001}})
    stable = stable_time_step(scene.particle, contact_law_of(scene))
    with pytest.raises(InputError) as caught:
        time_step(scene)
    assert str(caught.value) == (
        f"fidelity.time_step_s: 0.001 s is above the stable step {stable:.4g} s of this smarticle at "
        f"{scene.fidelity.stiffness_N_per_m:g} N/m; use at most {0.995 * stable:.3g} s or leave it out"
    )
    least = float(str(caught.value).split("use at most ")[1].split(" s")[0])
    assert 0.98 * stable < time_step(make_scene({"fidelity": {"time_step_s": least}})) <= stable


@pytest.mark.parametrize(("key", "value"), [("hinge_stiffness_N_per_m", 1e6), ("stiffness", 10.0)])
def test_stiff_hinges_and_shafts_shorten_the_step(make_scene: MakeScene, key: str, value: float) -> None:
    phases = [{"type": "deposit"}, {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1}]
    usual = make_scene({"phases": phases})
    changed = {"fidelity": {key: value}} if key.startswith("hinge") else {"motor": {"stiffness_N_m_per_rad": value}}
    stiff = make_scene({"phases": phases, **changed})
    # A shaft of 3e-3 N m/rad is far from ruling the step, one of 10 blew up before it was counted.
    assert time_step(stiff) < 0.5 * time_step(usual)
    barb = stiff.smarticle.boxes
    if key == "stiffness":
        # A barb on its shaft against a middle link that is heavier: between a free and a fixed end.
        about_hinge = barb.link_inertias[0, 2] + barb.link_masses[0] * (barb.barb_length / 2) ** 2
        fixed = 2 / math.sqrt(value / about_hinge)
        assert 0.2 * fixed < time_step(stiff) < fixed


SWING: dict[str, object] = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1}


def test_phases_before_the_motors_have_the_step_of_a_scene_without(make_scene: MakeScene) -> None:
    rest: list[dict[str, object]] = [{"type": "deposit"}, {"type": "relax", "duration_s": 1}]
    scene, without = make_scene({"phases": [*rest, SWING, *rest[1:]]}), make_scene({"phases": rest})
    shortest = time_step(scene)
    assert time_steps(scene) == (*time_steps(without), shortest, shortest)
    assert time_steps(without) == (time_step(without),) * 2
    assert time_steps(scene)[0] > 1.5 * shortest


@pytest.mark.parametrize("changes", [{"fidelity": {"time_step_s": 1e-5}}, {"phases": [{"type": "deposit"}]}])
def test_a_step_by_hand_or_no_motors_make_all_phases_alike(make_scene: MakeScene, changes: dict[str, object]) -> None:
    scene = make_scene({"phases": [{"type": "deposit"}, SWING], **changes})
    assert set(time_steps(scene)) == {time_step(scene)}
