"""Articulated smarticles, hinges and motors at work: small simulations with a known answer; see `cases.py`."""

import dataclasses
from pathlib import Path
from typing import Any

import cases
import numpy as np
from cases import axes_of, vec
from scipy.spatial.transform import Rotation

from dem.body.placement import place_layer
from dem.engine.demand import motor_law_of
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import hinge_law
from dem.scene.scene import Scene
from validation.access import bodies_of as bodies
from validation.bench import Targets, add, drive, scene_of

TILTED = Rotation.from_rotvec([0.4, 0.2, -0.7])


def build(scene: Scene, *, dt: float | None = None, radius: float = 0.5, **instead: Any) -> YadeEngine:
    """An engine for smarticles that are articulated."""
    laws = {"hinge_law": hinge_law(scene), "motor_law": motor_law_of(scene)}
    return cases.build(scene, dt=dt, radius=radius, facets=16, **(laws | instead))


def floating(data: dict[str, Any], *, velocity: Any = (0, 0, 0), spin: Any = (0, 0, 0)) -> tuple[Scene, YadeEngine]:
    """One smarticle, welded, without gravity, far from everything."""
    scene = scene_of(data)
    engine = build(scene, gravity=0.0)
    add(engine, (0, 0, 0.05), TILTED)
    cases.push(engine, 0, velocity=velocity, spin=spin)
    return scene, engine


def momentum(engine: YadeEngine) -> np.ndarray:
    return sum((b.mass * vec(b.vel) for b in bodies(engine)), np.zeros(3))


def angular_momentum(engine: YadeEngine) -> np.ndarray:
    """About the origin."""
    parts = (np.cross(vec(b.pos), b.mass * vec(b.vel)) + vec(b.angMom) for b in bodies(engine))
    return sum(parts, np.zeros(3))


def kinetic_energy(engine: YadeEngine) -> float:
    """From velocities and from the angular momenta that YADE integrates."""
    total = 0.0
    for b in bodies(engine):
        axes = axes_of(b)
        own = axes.T @ vec(b.angMom)
        total += 0.5 * b.mass * vec(b.vel) @ vec(b.vel) + 0.5 * float((own**2 / vec(b.inertia)).sum())
    return total


def sphere_positions(engine: YadeEngine) -> np.ndarray:
    """(S, 3) of all smarticles, sphere by sphere, where YADE has them."""
    return np.array([vec(engine._omega.bodies[s].state.pos) for s in sorted(engine._assembly.smarticle_of)])


def sphere_velocities(engine: YadeEngine) -> np.ndarray:
    return np.array([vec(engine._omega.bodies[s].state.vel) for s in sorted(engine._assembly.smarticle_of)])


def snapshot(engine: YadeEngine) -> dict[str, Any]:
    return {
        "p": momentum(engine),
        "l": angular_momentum(engine),
        "e": kinetic_energy(engine),
        "e_state": engine.state().kinetic_energy,
        "spheres": sphere_positions(engine),
        "sphere_velocities": sphere_velocities(engine),
        "vertices": engine.state().vertices,
        "angles": engine.state().angles,
        "gap": engine.motors.gaps().max(),
    }


# -- welding and splitting ---------------------------------------------------------------------------------------------


def inertia_tensor(engine: YadeEngine) -> np.ndarray:
    """(3, 3) of all bodies about their common centre of mass, where YADE has them."""
    links = bodies(engine)
    mass = sum(b.mass for b in links)
    centre = sum(b.mass * vec(b.pos) for b in links) / mass
    total = np.zeros((3, 3))
    for b in links:
        axes, arm = axes_of(b), vec(b.pos) - centre
        total += axes @ np.diag(vec(b.inertia)) @ axes.T + b.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return total


def split_and_weld(data: dict[str, Any], *, velocity: Any, spin: Any, steps: int) -> dict[str, Any]:
    """A flying, spinning smarticle is split, welded and split again, all between two steps."""
    _, engine = floating(data, velocity=velocity, spin=spin)
    engine.advance(steps)
    out = {"before": snapshot(engine)}
    engine.motors.articulate()
    out["split"] = snapshot(engine)
    out["loss"] = engine._assembly.weld()
    out["welded"] = snapshot(engine)
    out["moments"] = np.sort(vec(bodies(engine)[0].inertia))
    engine.motors.articulate()
    out["again"] = snapshot(engine)
    return {**out, "dt": engine.time_step, "size": engine.particle.reach}


def weld_in_motion(data: dict[str, Any], *, targets_deg: Any, spin: Any, time: float) -> dict[str, Any]:
    """Barbs that are on their way are welded; what rigid bodies say about the loss."""
    scene, engine = floating(data, velocity=(0.1, -0.2, 0.3), spin=spin)
    engine.advance(1)
    engine.motors.articulate()
    begun, goal = engine.state().angles[0], np.radians(targets_deg)
    for _ in drive(engine, scene, time, lambda t: begun + (goal - begun) * t / time):
        pass
    before = snapshot(engine)
    mass, tensor = scene.smarticle.boxes.mass, inertia_tensor(engine)
    centre = engine.state().positions[0]
    own = before["l"] - np.cross(centre, before["p"])
    rigid = before["p"] @ before["p"] / (2 * mass) + own @ np.linalg.solve(tensor, own) / 2
    loss = engine._assembly.weld()
    after = snapshot(engine)
    spun = np.linalg.solve(tensor, own)
    exact = dataclasses.replace(scene.smarticle.boxes, angles=tuple(after["angles"][0]))
    engine.advance(200)
    return {
        "before": before,
        "after": after,
        "loss": loss,
        "relative": before["e"] - rigid,
        "tensor": np.sort(np.linalg.eigvalsh(inertia_tensor(engine))),
        "exact": np.sort(exact.inertia),
        "field": before["p"] / mass + np.cross(spun, after["spheres"] - centre),
        "mass": bodies(engine)[0].mass,
        "exact_mass": exact.mass,
        "gap": before["gap"],
        "later": snapshot(engine),
    }


def forces(engine: YadeEngine) -> dict[tuple[int, int], np.ndarray]:
    """Forces of all contacts that carry one, by sphere."""
    owner = engine._assembly.smarticle_of
    return {
        (i.id1, i.id2): vec(i.phys.normalForce + i.phys.shearForce)
        for i in engine._omega.interactions
        if i.isReal and (i.id1 in owner or i.id2 in owner) and i.phys.normalForce.norm() > 0
    }


def resting_pile(data: dict[str, Any], *, count: int, settle: float, change: str) -> dict[str, Any]:
    """A settled pile; contact forces one step after it was split ("split"), welded again ("weld"), or left alone.

    The same steps lead up to the change, so that a pile left alone is the answer.
    """
    scene = scene_of(data)
    engine = build(scene, radius=scene.container.radius_m)
    rng = np.random.default_rng(scene.seed)
    layer = {"count": count, "radius": scene.container.radius_m, "bottom": 1e-4, "height": 1e-2, "rng": rng}
    engine.add(place_layer(scene.body, obstacles=np.empty((0, 3)), **layer))
    engine.advance(round(settle / engine.time_step))
    split_first = change in ("split-rest", "weld")
    if split_first:
        engine.motors.articulate()
        begun = engine.state().angles
        for _ in drive(engine, scene, 0.1, lambda _: begun):
            pass
    places, before = sphere_positions(engine), forces(engine)
    if change == "split":
        engine.motors.articulate()
    elif change == "weld":
        engine.motors.weld()
    kept = forces(engine)
    moved = np.abs(sphere_positions(engine) - places).max()
    engine.advance(1)
    after, weight = forces(engine), scene.smarticle.boxes.mass * 9.81
    return {"before": before, "kept": kept, "after": after, "moved": moved, "weight": weight}


def own_contacts(engine: YadeEngine) -> int:
    """Contacts with a force between spheres of one smarticle."""
    owner = engine._assembly.smarticle_of
    return sum(
        owner.get(i.id1, -1) == owner.get(i.id2, -2) and i.phys.normalForce.norm() > 0
        for i in engine._omega.interactions
        if i.isReal
    )


def reloaded(data: dict[str, Any], *, angle: float, spin: Any, folder: str) -> dict[str, Any]:
    """Save and load a smarticle whose barbs are at an angle [rad], and let its motors update."""
    scene, engine = floating(data, spin=spin)
    engine.motors.articulate()
    for _ in drive(engine, scene, 0.25, lambda _: [angle, angle]):
        pass
    saved = (engine.motors._hinges.angles(), engine.motors._hinges.gaps(), engine.motors._hinges.torques())
    engine.load(engine.save(Path(folder)), Path(folder))
    loaded = (engine.motors._hinges.angles(), engine.motors._hinges.gaps(), engine.motors._hinges.torques())
    engine.motors.actuate(np.full((1, 1, 2), angle), scene.fidelity.control_interval_s)
    return {"saved": saved, "loaded": loaded, "after": engine.motors._hinges.torques(), "state": engine.state().angles}


# -- hinges and motors -------------------------------------------------------------------------------------------------


def gait(
    data: dict[str, Any], *, straight_in: float, velocity: Any = (0, 0, 0), spin: Any = (0, 0, 0)
) -> dict[str, Any]:
    """A free smarticle straightens and bends back; conserved sums every millisecond."""
    scene, engine = floating(data, velocity=velocity, spin=spin)
    engine.advance(1)
    engine.motors.articulate()
    begun = engine.state().angles
    rows: list[tuple[Any, ...]] = []
    start = momentum(engine), angular_momentum(engine)

    def targets(time: float) -> np.ndarray:
        return begun * abs(1 - time / straight_in)

    for time in drive(engine, scene, 2 * straight_in, targets):
        if round(time / scene.fidelity.control_interval_s) % 5:
            continue  # 1 ms
        links = bodies(engine)
        centre = sum(b.mass * vec(b.pos) for b in links) / sum(b.mass for b in links)
        own = [np.cross(vec(b.pos) - centre, b.mass * vec(b.vel)) + vec(b.angMom) for b in links]
        rows.append(
            (
                np.abs(momentum(engine) - start[0]).max(),
                sum(b.mass * np.linalg.norm(vec(b.vel)) for b in links),
                np.abs(angular_momentum(engine) - start[1]).max(),
                sum(np.linalg.norm(part) for part in own),
                engine.motors.gaps().max() / scene.sphere_diameter,
                np.abs(engine.state().angles - targets(time)).max(),
                kinetic_energy(engine),
            )
        )
    keys = ("momentum", "links_momentum", "angular", "links_angular", "gap", "error", "energy")
    columns = {key: np.array(column) for key, column in zip(keys, zip(*rows, strict=True), strict=True)}
    return {**columns, "angles": engine.state().angles - begun}


def sweep(data: dict[str, Any], *, corners: list[tuple[float, float]], speed: float) -> dict[str, Any]:
    """Both barbs turned from corner to corner [deg] of their range, at a constant speed [rad/s]."""
    scene, engine = floating(data)
    engine.motors.articulate()
    touching, reached, gap = 0, [engine.state().angles[0]], 0.0
    for corner in np.radians(corners):
        begun = engine.motors.readings.commands[0].copy()
        duration = max(np.abs(corner - begun).max() / speed, 1e-3)
        for _ in drive(engine, scene, duration, lambda t, a=begun, b=corner, d=duration: a + (b - a) * min(t / d, 1)):
            touching += own_contacts(engine)
            gap = max(gap, engine.motors.gaps().max())
            reached.append(engine.state().angles[0])
    return {"touching": touching, "angles": np.degrees(reached), "gap": gap / scene.sphere_diameter}


def hold_all(engine: Any, blocked: str) -> None:
    """Stop all links of the first smarticle, and hold them, or let them go."""
    zero = engine._yade.vector(0, 0, 0)
    for body in bodies(engine)[:3]:
        body.blockedDOFs = blocked
        body.vel, body.angVel, body.angMom = zero, zero, zero


def blocked(data: dict[str, Any], *, freed: bool, back: float) -> dict[str, Any]:
    """All links held while the motors straighten; then freed, or moved back by an angle."""
    scene, engine = floating(data)
    engine.motors.articulate()
    hold_all(engine, "xyzXYZ")
    begun = engine.state().angles[0]
    commands, torques, halted = [], [], []

    def follow(duration: float, targets: Targets) -> None:
        for _ in drive(engine, scene, duration, targets):
            commands.append(engine.motors.readings.commands[0])
            torques.append(engine.motors._hinges.torques()[0])
            halted.append(engine.motors.readings.halted[0])

    follow(0.02, lambda t: begun - 5 * t)
    marks = [len(commands)]
    if freed:
        hold_all(engine, "")
    goal = begun - 0.1 if freed else engine.motors.readings.commands[0] + back
    follow(0.1, lambda _: goal)
    return {
        "begun": begun,
        "goal": goal,
        "mark": marks[0],
        "commands": np.array(commands),
        "torques": np.array(torques),
        "halted": np.array(halted),
        "angles": engine.state().angles[0],
        "limit": scene.torque_limit,
        "advance": scene.motor.stiffness_N_m_per_rad
        * scene.motor.speed_limit_rad_per_s
        * scene.fidelity.control_interval_s,
    }
