"""YADE as an engine, without running it: the stable step, dissipation of contacts, a machine without YADE."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scenes import small

from dem.engine.demand import contact_law_of
from dem.engine.yade.ledger import Contacts
from dem.engine.yade.library import import_yade
from dem.engine.yade.stable_step import CONTACTS_AT_A_TIP, stable_time_step
from dem.errors import RunError
from dem.run.run import run_scene
from dem.scene.scene import Scene


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
    """Largest stable step of smarticles lying flat on each other: eigenvalues of the damped leapfrog map.

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
def test_stable_step_equals_the_limit_of_the_iterated_schemes(changes: dict[str, object]) -> None:
    scene = small(changes)
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
def test_stable_step_is_stable_for_piles_lying_flat(changes: dict[str, object], layers: int) -> None:
    scene = small(changes)
    assert stable_time_step(scene.particle, contact_law_of(scene)) <= limit_of_a_flat_pile(scene, layers) * (1 + 1e-3)


KN, KS, MASS = 500.0, 400.0, 1e-4


def contact(
    *,
    before: tuple[float, float, float],
    after: tuple[float, float, float],
    overlap: float,
    viscous: float = 0.0,
    shear: tuple[float, float, float] = (0.0, 0.0, 0.0),
    damping: tuple[float, float] = (0.0, 0.0),
    friction: float = 0.0,
) -> Contacts:
    """One contact; the first body is below the second, velocities are those of the second against the first."""
    return Contacts(
        normals=np.array([[0.0, 0.0, 1.0]]),
        before=np.array([before]),
        after=np.array([after]),
        overlaps=np.array([overlap]),
        viscous=np.array([viscous]),
        shear=np.array([shear]),
        stiffness=np.array([[KN, KS]]),
        damping=np.array([damping]),
        friction=np.array([friction]),
    )


def bounce(damping: float, step: float) -> tuple[float, float]:
    """Kinetic energy lost by a mass that bounces off a fixed sphere, and what the contact says of it."""
    height, speed, said = 1.3e-5, -0.3, 0.0
    for _ in range(100_000):
        overlap = -height
        before = speed
        if overlap > 0:
            viscous = -damping * speed
            speed += max(KN * overlap + viscous, 0.0) / MASS * step
            said += contact(
                before=(0, 0, before), after=(0, 0, speed), overlap=overlap, viscous=viscous, damping=(damping, 0.0)
            ).dissipated(step)
        height += speed * step
        if speed > 0 and height > 1e-4:
            return 0.5 * MASS * (0.3**2 - speed**2), said
    raise AssertionError("never came back")


@pytest.mark.parametrize("ratio", [0.05, 0.2, 0.6])
def test_bounce_loses_what_the_contact_dissipates(ratio: float) -> None:
    damping = 2 * ratio * math.sqrt(KN * MASS)
    errors = []
    for step in (2e-5, 1e-5, 2.5e-6):
        lost, said = bounce(damping, step)
        assert lost > 0.1 * 0.5 * MASS * 0.3**2 * ratio
        errors.append(abs(said - lost) / (0.5 * MASS * 0.3**2))
    # What is left is the energy of a contact that begins in the middle of a step, k (v dt)²/2 at most.
    assert max(errors[1:]) < 0.5 * KN * 1e-5**2 / (0.5 * MASS)
    assert errors[2] < 0.002


def test_steady_sliding_dissipates_friction_times_way() -> None:
    overlap, friction, speed, step = 1e-5, 0.4, 0.05, 1e-5
    limit = friction * KN * overlap
    # The second body moves along +x; the force that the law keeps is on the way of the first against the second.
    sliding = contact(
        before=(speed, 0, 0), after=(speed, 0, 0), overlap=overlap, shear=(-limit, 0, 0), friction=friction
    )
    assert sliding.dissipated(step) == pytest.approx(limit * speed * step, rel=1e-9, abs=0)


def test_sticking_spring_stores_and_dashpot_dissipates() -> None:
    overlap, speed, step, dashpot = 1e-5, 1e-4, 1e-5, 0.02
    common = {"before": (speed, 0, 0), "after": (speed, 0, 0), "overlap": overlap, "friction": 0.4}
    shear = (-1e-4, 0.0, 0.0)
    stored = ((1e-4 + KS * speed * step) ** 2 - 1e-4**2) / (2 * KS)
    plain = contact(shear=shear, **common).dissipated(step)
    # Work along the way less what the spring gains: the scheme's half square only.
    assert plain == pytest.approx(1e-4 * speed * step - stored, abs=1e-22)
    assert abs(plain) < 0.01 * stored
    damped = contact(shear=shear, damping=(0.0, dashpot), **common).dissipated(step)
    assert damped - plain == pytest.approx(dashpot * speed**2 * step, rel=1e-6, abs=0)


@pytest.fixture
def no_yade(monkeypatch: pytest.MonkeyPatch) -> None:
    """An import of yade that fails, whatever is installed."""
    monkeypatch.setitem(sys.modules, "yade", None)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")


@pytest.mark.usefixtures("no_yade")
def test_missing_yade_leaves_no_directory(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with pytest.raises(RunError, match=r"^YADE cannot be imported .* `make setup`"):
        run_scene(small(), out, command="test")
    assert not out.exists()


def test_yade_that_breaks_on_import_says_the_cause(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "yade").mkdir()
    (tmp_path / "yade" / "__init__.py").write_text("raise ImportError('libboost_python311.so.1.74: cannot open')")
    monkeypatch.delitem(sys.modules, "yade", raising=False)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    with pytest.raises(RunError, match=r"^YADE cannot be imported \(libboost_python311\.so\.1\.74: cannot open\)"):
        import_yade()
