"""Simulations broken on purpose: the watchdog says so, and which smarticles are concerned."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from dem.engine.interface import Engine
from dem.errors import RunError
from dem.plan.steps import stable_step
from dem.record.names import FAILED
from dem.run.recorder import Recorder
from dem.scene.scene import Scene
from validation.bench import add, fastest, look, lying, watched
from validation.check import Check, below, says
from validation.engines import EngineAccess
from validation.hard.runs import whole
from validation.hard.scenes import RELAX, scene, shape_change, swing

NO_NUMBER = "1 smarticle(s) (1): positions or velocities are no numbers, the simulation has blown up; lower fidelity"
LEFT = "1 smarticle(s) (1): left through the wall or the floor; raise fidelity.stiffness_N_per_m"
SPOILT = {
    "velocity": NO_NUMBER,
    "position": NO_NUMBER,
    "spin": NO_NUMBER,
    "speed": "1 smarticle(s) (1): a speed above",
    "over the wall": "1 smarticle(s) (1): thrown out over the wall of",
    "through the wall": LEFT,
    "under the floor": LEFT,
    "hinge": "1 smarticle(s) (1): links more than",
    "overlap": "2 smarticle(s) (0, 1): contacts more than",
}

LONG_CONTROL = 1e-3  # s; steps of links are as long as the control period of draft
PLACES = ("over the wall", "through the wall", "under the floor")


def spoil(access: EngineAccess, out: Path, *, what: str, articulated: bool, steps: int) -> list[Check]:
    """Three smarticles at rest on the floor; then the second one is spoilt, and the next look says so."""
    described, engine, recorder = watched(scene(access, shape_change(1.5), count=3), out)
    # A few diameters apart, so that none falls on another.
    for k in range(3):
        add(engine, (0, 0, lying(described) + 1e-5 + 3 * k * described.particle.radius))
    engine.advance(10)
    if articulated:
        engine.motors.articulate()
    before = look(engine, recorder)
    access.spoil(engine, what)
    unhinged = articulated and access.pin_stiffness(described) == math.inf
    try:
        # Nothing of it has to come along with the next steps where there are no hinges.
        engine.advance(0 if unhinged and what in PLACES else steps)
        said = look(engine, recorder)
    except RunError as error:
        said = str(error)
    # One link that is put out of the container tears its hinge first.
    torn = articulated and not unhinged and what in PLACES
    expected = "1 smarticle(s) (1): " if torn else SPOILT[what]
    if what == "overlap" and access.pin_stiffness(described) == math.inf:
        # On links they have pushed each other apart by the next check; then their energy tells of it.
        expected = " smarticle(s) (0, 1"
    return [Check("the look before says", before or "nothing", "nothing", before is None), says(said, expected)]


def _resting(access: EngineAccess, out: Path, count: int) -> tuple[Engine, Recorder]:
    """Smarticles in a low stack that has come to rest, and a recorder that has seen it."""
    described, engine, recorder = watched(scene(access, count=count), out)
    for k in range(count):
        add(engine, (0, 0, lying(described) * (2 * k + 1) + 1e-5))
    for _ in range(10):
        engine.advance(round(0.02 / engine.time_step))
        assert look(engine, recorder) is None
    return engine, recorder


def heated(access: EngineAccess, out: Path, *, count: int, share: float) -> list[Check]:
    """A pile at rest, in which the dashpots of all contacts are made to drive instead: energy grows out of nothing."""
    engine, recorder = _resting(access, out, count)
    access.heat(engine, share)
    access.push(engine, count - 1, velocity=(0, 0, 1e-3))
    said, fast, begun = None, 0.0, engine.time
    while not said and engine.time < begun + 5.0:
        engine.advance(round(recorder.interval / engine.time_step))
        fast = fastest(engine)
        said = look(engine, recorder)
    return [
        says(said, "an energy that has risen by", "more than gravity, motors and springs explain", "lower fidelity"),
        below("greatest speed then, over the limit of speed [1]", fast / recorder.watchdog.speed, 0.5),
    ]


def kicked(access: EngineAccess, out: Path, *, count: int, speed: float) -> list[Check]:
    """A pile at rest, all of it suddenly moving upwards, far below the limit of speed."""
    engine, recorder = _resting(access, out, count)
    for k in range(count):
        access.push(engine, k, velocity=(0, 0, speed))
    return [
        says(look(engine, recorder), f"{count} smarticle(s) (0, 1", "an energy that has risen by"),
        below("speed over the limit of speed [1]", speed / recorder.watchdog.speed, 0.2),
    ]


def soft(access: EngineAccess, out: Path, *, stiffness: float) -> list[Check]:
    """Contacts so soft that the floor does not hold what falls on it: a scene may ask for it."""
    data = scene(access, RELAX, fidelity={"base": "draft", "stiffness_N_per_m": stiffness})
    run = whole(data, out)
    return [says(run.text, "at t = ", "raise fidelity.stiffness_N_per_m")]


def wrong_step(access: EngineAccess, out: Path, *, factor: float, count: int, seconds: float) -> list[Check]:
    """A time step above the stable one, slipped past the check: the run fails, and names its last checkpoint."""
    fidelity = "draft" if access.name == "yade" else {"base": "draft", "control_interval_s": LONG_CONTROL}
    data = scene(access, swing(seconds), count=count, fidelity=fidelity, recording={"checkpoint_interval_s": 0.02})
    run = whole(data, out, steps=lambda scene: (_too_long(scene, factor),) * len(scene.phases))
    return [
        Check(
            "kind of error",
            run.error[0] if run.error else "none",
            "RunError",
            bool(run.error and run.error[0] == "RunError"),
        ),
        says(run.text, "(last good checkpoint: "),
    ]


def _too_long(described: Scene, factor: float) -> float:
    control = described.fidelity.control_interval_s
    step: float = control / max(1, math.floor(control / (factor * stable_step(described))))
    return step


def late(access: EngineAccess, out: Path) -> list[Check]:
    """A run that goes wrong after a while: the error has the time of the checkpoint before, and the file too."""
    data = scene(access, {"type": "relax", "duration_s": 0.4}, recording={"checkpoint_interval_s": 0.1})

    def spoil(engine: Engine) -> None:
        if engine.time > 0.55:
            access.push(engine, 2, velocity=(0, 0, 100))

    run = whole(data, out, spoil=spoil)
    text = (out / FAILED).read_text(encoding="utf-8") if (out / FAILED).exists() else None
    return [
        says(run.text, "1 smarticle(s) (2): a speed above", "(last good checkpoint: t = 0.5000 s)"),
        says(text, '"status": "failed"', '"checkpoint_s": 0.'),
    ]


def cost(access: EngineAccess, out: Path, *, fidelity: str, count: int, activity: str, seconds: float) -> list[Check]:
    """What the looks of the watchdog take of the processor time of a whole run.

    Compiled code is loaded once in a run, however long that is: of a share of a short one it would be most.
    """
    phases: dict[str, dict[str, Any]] = {
        "at rest": {"type": "relax"},
        "shaken": {"type": "shake", "frequency_hz": 30, "peak_acceleration_g": 2},
        "swinging": {"type": "internal-oscillation", "theta_deg": 10},
    }
    data = scene(access, {**phases[activity], "duration_s": seconds}, count=count, per_layer=10, fidelity=fidelity)
    run = whole(data, out, note=False)
    ended = Check("ends", run.text or "done", "done", run.error is None)
    return [
        ended,
        below("share of the processor time, but for the first look [1]", run.cost, 0.01),
        below("processor time of the first look [s]", run.first_look, 0.2),
    ]
