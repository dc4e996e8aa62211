"""Hinges and motors at work: small simulations whose answer is known, in the worker process; SI throughout."""

from __future__ import annotations

import math
from typing import Any

import cases
import numpy as np
from articulated_cases import (
    angular_momentum,
    build,
    floating,
    kinetic_energy,
    momentum,
    own_contacts,
    vec,
)

from dem.engine.demand import contact_law_of
from dem.engine.yade.kind import hinge_law
from dem.engine.yade.stable_step import hinged_stable_time_step
from validation.access import bodies_of as bodies
from validation.bench import Targets, drive


def gait(
    data: dict[str, Any],
    *,
    straight_in: float,
    velocity: Any = (0, 0, 0),
    spin: Any = (0, 0, 0),
    every_step: bool = False,
) -> dict[str, Any]:
    """A free smarticle straightens and bends back; conserved sums, and the work of the motors step by step."""
    scene, engine = floating(data, velocity=velocity, spin=spin)
    engine.advance(1)
    engine.motors.articulate()
    begun = engine.state().angles
    rows: list[tuple[Any, ...]] = []
    torques, angles = [engine.motors._hinges.torques()[0]], [engine.motors._hinges.angles()[0]]
    start = momentum(engine), angular_momentum(engine), kinetic_energy(engine)

    def targets(time: float) -> np.ndarray:
        return begun * abs(1 - time / straight_in)

    def noted() -> None:
        torques.append(engine.motors._hinges.torques()[0])
        angles.append(engine.motors._hinges.angles()[0])

    for time in drive(engine, scene, 2 * straight_in, targets, each=noted if every_step else None):
        if not every_step and round(time / scene.fidelity.control_interval_s) % 5:
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
    tau, alpha = np.array(torques), np.array(angles)
    return {
        **{key: np.array(column) for key, column in zip(keys, zip(*rows, strict=True), strict=True)},
        "energy_before": start[2],
        "elastic": engine.motors._hinges.elastic_energy(),
        "work": ((tau[1:] + tau[:-1]) / 2 * np.diff(alpha, axis=0)).sum(axis=1).cumsum(),
        "told": float(engine.motors.readings.work.sum()),
        "twisted": float((tau[-1] ** 2).sum() / (2 * scene.motor.stiffness_N_m_per_rad)),
        "angles": engine.state().angles - begun,
    }


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
    return {
        "touching": touching,
        "angles": np.degrees(reached),
        "gap": gap / scene.sphere_diameter,
        "potential": sum(1 for i in engine._omega.interactions if i.isReal),
    }


def stack(data: dict[str, Any], *, layers: int, times_stable: float, settle: float, watch: float) -> dict[str, Any]:
    """Articulated smarticles lying flat on each other, let go from a slight height; largest speed of a link."""
    scene = cases.scene_of(data)
    law, particle = contact_law_of(scene), scene.particle
    dt = times_stable * hinged_stable_time_step(particle, law, hinge_law(scene))
    interval = dt * max(1, round(scene.fidelity.control_interval_s / dt))
    engine = build(scene, dt=dt)
    thick = np.ptp(particle.centres[:, 2]) + 2 * particle.radius
    for k in range(layers):
        cases.add(engine, (0, 0, (k + 0.5) * thick + (k + 1) * 2e-5))
    engine.motors.articulate()
    begun, fastest, gap = engine.state().angles, 0.0, 0.0
    for time in drive(engine, scene, settle + watch, lambda _: begun, interval=interval):
        gap = max(gap, engine.motors.gaps().max())
        if not gap < thick:
            return {"fastest": math.inf, "gap": math.inf, "z": np.full(layers, math.nan), "thick": thick, "dt": dt}
        if time > settle:
            fastest = max(fastest, float(np.linalg.norm(engine.state().link_velocities, axis=2).max()))
    return {
        "fastest": fastest,
        "gap": gap / scene.sphere_diameter,
        "z": engine.state().positions[:, 2],
        "thick": thick,
        "dt": dt,
    }


def hold_all(engine: Any, *, blocked: str = "xyzXYZ") -> None:
    """Hold all links of the first smarticle where they are."""
    zero = engine._yade.vector(0, 0, 0)
    for body in bodies(engine)[:3]:
        body.blockedDOFs = blocked
        body.vel, body.angVel, body.angMom = zero, zero, zero


def let_go(engine: Any) -> None:
    """Let go of them."""
    hold_all(engine, blocked="")


def blocked(data: dict[str, Any], *, freed: bool, back: float) -> dict[str, Any]:
    """All links held while the motors are told to straighten; then freed, or told to go back by an angle."""
    scene, engine = floating(data)
    engine.motors.articulate()
    hold_all(engine)
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
        let_go(engine)
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
