"""Known answers for the driver, before it is trusted with a pile: one smarticle, its middle link held."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.chrono.cases import RULES, common
from benchmarks.chrono.running import simulate
from benchmarks.chrono.task import PAPER, SHARE_OF_INERTIA, barb_inertia, of_engine, of_smarticle, poses
from dem.body.state import State
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

Array = NDArray[np.float64]

ON_ITS_BACK = np.column_stack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Body frame to laboratory frame of a U whose middle link stands upright, so that its barbs stand out level."""
FREE_S, HELD_S = 1.6, 0.05  # s simulated
HEAVY = 3.0  # times a barb's own mass
CRUSHING = 60.0  # times gravity: a barb's weight takes six times τ_max
TURN, TORQUE = 1e-3, 1e-3  # rad; share of the torque: what counts as the known answer


@dataclass(frozen=True)
class Check:
    """One known answer.

    Args:
        what: in words.
        found: by the driver.
        known: answer.
        tolerance: greatest difference.
    """

    what: str
    found: float
    known: float
    tolerance: float

    @property
    def holds(self) -> bool:
        """Whether it was found."""
        return abs(self.found - self.known) <= self.tolerance


def alone(rules: str) -> Scene:
    """A scene of one smarticle, for its geometry, motors and friction."""
    phases = [{"type": "deposit"}, {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1.0}]
    return parse_scene({**common(rules, 1, 1), "phases": phases}, source="checks")


def task(scene: Scene, targets: Sequence[float], *, gravity: float) -> dict[str, Sequence[float]]:
    """One smarticle in the air, its middle link held upright, its motors told to be at angles [rad], step by step."""
    still = np.zeros((1, 3))
    state = State.rigid(scene.particle.boxes, still, ON_ITS_BACK[None], still, still)
    told = of_engine(replace(PAPER, wall_height=0.0, iterations=200), 1)
    told |= of_smarticle(scene, PAPER)
    return told | {
        "radius_m": [scene.container.radius_m],
        "slow_steps": [0],
        "settle_steps": [0],
        "rest_steps": [0],
        "steps": [len(targets)],
        "look_steps": [1],
        "targets_rad": targets,
        "gravity_m_per_s2": [gravity],
        "poses": poses(state.link_positions, state.link_rotations),
        "held": [1],
    }


def known_answers(driver: Path, folder: Path) -> list[Check]:
    """All of them, by both rules."""
    return [
        check for rules in RULES for found in (_turns, _holds, _overloaded) for check in found(driver, folder, rules)
    ]


def _turns(driver: Path, folder: Path, rules: str) -> list[Check]:
    """A barb that nothing is in the way of goes where the schedule goes, and its work is its kinetic energy."""
    scene = alone(rules)
    dt, start = PAPER.time_step, scene.particle.boxes.angles[0]
    steps = round(FREE_S / dt)
    targets = [start * max(0.0, 1 - (k + 1) * dt / 1.5) for k in range(steps)]
    found = simulate(driver, folder, f"check-free-{rules}", task(scene, targets, gravity=0.0), 1)
    half = round(0.75 / dt)
    ramp = start / 1.5
    boxes = scene.particle.boxes
    inertia = barb_inertia(boxes)
    kinetic = 0.5 * inertia * ramp**2
    angles, work = found.barbs[:, 0, :, 0], found.barbs[:, 0, :, 2]
    return [
        Check(f"{rules}: angle half way through the opening [rad]", float(angles[half].mean()), start / 2, TURN),
        Check(f"{rules}: angle of both barbs after it [rad]", float(np.abs(angles[-1]).max()), 0.0, TURN),
        Check(f"{rules}: by its links' poses [rad]", _widest(found.state(len(found) - 1, boxes)), 0.0, 2 * TURN),
        Check(f"{rules}: work while it turns [J]", float(work[half].mean()), kinetic, 0.01 * kinetic),
        Check(f"{rules}: work once it stopped [J]", float(np.abs(work[-1]).max()), 0.0, 0.01 * kinetic),
    ]


def _widest(state: State) -> float:
    return float(np.abs(state.angles).max())


def _holds(driver: Path, folder: Path, rules: str) -> list[Check]:
    """A level barb of known weight is held with m g r; beyond τ_max it is held too, and does not rise."""
    scene = alone(rules)
    boxes, gravity = scene.particle.boxes, scene.gravity_m_per_s2
    steps = round(HELD_S / PAPER.time_step)
    told = task(scene, [boxes.angles[0]] * steps, gravity=gravity)
    told["link_masses_kg"] = [HEAVY * mass for mass in boxes.link_masses]
    found = simulate(driver, folder, f"check-held-{rules}", told, 1)
    static = HEAVY * boxes.link_masses[0] * gravity * boxes.barb_length / 2
    # Upright, barb 1 is the lower one: weight turns it away from the middle link, barb 2 towards it.
    last = found.barbs[-1, 0, :, 1]
    sinks = float(np.abs(found.barbs[-1, 0, :, 0] - boxes.angles[0]).max())
    lifted = _lifted(driver, folder, rules)
    return [
        Check(f"{rules}: torque on barb 1, m g r [N m]", float(last[0]), static, TORQUE * static),
        Check(f"{rules}: torque on barb 2, -m g r [N m]", float(last[1]), -static, TORQUE * static),
        Check(f"{rules}: it sinks meanwhile by [rad]", sinks, 0.0, TURN),
        lifted,
    ]


def _lifted(driver: Path, folder: Path, rules: str) -> Check:
    """Work of lifting a level barb by a small angle: its weight times the height, as far as it got."""
    scene = alone(rules)
    boxes, gravity, dt = scene.particle.boxes, scene.gravity_m_per_s2, PAPER.time_step
    start, rate, steps = boxes.angles[0], 0.5, round(0.2 / PAPER.time_step)
    told = task(scene, [start + rate * (k + 1) * dt for k in range(steps)], gravity=gravity)
    found = simulate(driver, folder, f"check-lift-{rules}", told, 1)
    inertia = barb_inertia(boxes)
    turned = found.barbs[-1, 0, :, 0] - start
    # Both turn by the same angle, one against its weight and one with it, so that the heights cancel in the sum and
    # add up in the difference.
    work = found.barbs[-1, 0, :, 2]
    known = 2 * boxes.link_masses[0] * gravity * boxes.barb_length / 2 * math.sin(float(turned.mean()))
    return Check(
        f"{rules}: work to lift a barb, twice, less its own motion [J]",
        float(work[0] - work[1]),
        known,
        0.02 * known + inertia * rate**2 * 0.01,
    )


def _overloaded(driver: Path, folder: Path, rules: str) -> list[Check]:
    """Barbs told to rise at 6 rad/s, barb 1 against a weight beyond τ_max, barb 2 with it: what each turns in 20 steps.

    By the code's rule the first step is at full speed, the next at half; both barbs count together, so that barb 2 is
    found the twentieth time, and barb 1 the twenty-first, ten and eleven steps later, and both stop. By the text's rule
    barb 1 stops at once, after the step in which it began to move, and barb 2, whose load helps, speeds up.
    """
    scene = alone(rules)
    boxes, dt, speed = scene.particle.boxes, PAPER.time_step, scene.motor.speed_limit_rad_per_s
    steps, start = 20, boxes.angles[0]
    targets = [start + speed * (k + 1) * dt for k in range(steps)]
    told = task(scene, targets, gravity=CRUSHING * scene.gravity_m_per_s2)
    found = simulate(driver, folder, f"check-overloaded-{rules}", told, 1).barbs[-1, 0, :, 0] - start
    if rules == "code":
        known = [speed * dt * (1 + 10 / 2), speed * dt * (1 + 9 / 2)]
    else:
        step = SHARE_OF_INERTIA * scene.torque_limit / barb_inertia(boxes) * dt
        known = [step * dt, sum(min(speed, (k + 1) * step) for k in range(steps)) * dt]
    return [
        Check(f"{rules}: barb {k + 1}, overloaded, turns by [rad]", float(found[k]), known[k], 1e-3 * known[k])
        for k in range(2)
    ]
