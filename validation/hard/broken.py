"""Corrupted simulations: the watchdog must report the error and the affected smarticles.

In all cases `access` is the engine, with access to its internals, `out` the run directory, and times are simulated
times [s]. A case returns its checks.
"""

import math
from pathlib import Path
from typing import Any

from dem.engine.interface import Engine
from dem.errors import RunError
from dem.plan.steps import stable_step
from dem.record.names import FAILED, LOG
from dem.run.recorder import Recorder
from dem.scene.scene import Scene
from validation.access import EngineAccess
from validation.bench import RELAX, add, fastest, lying, scene_data, shape_change, swing, watchdog_error, watched
from validation.cases import Check, below, hard, nothing, says
from validation.hard.runs import whole

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

LONG_CONTROL = 1e-3  # control period [s] that allows time steps above the stable one on links
PLACES = ("over the wall", "through the wall", "under the floor")


def spoil(access: EngineAccess, out: Path, *, what: str, articulated: bool, steps: int) -> list[Check]:
    """Set the invalid state `what` of the second of three smarticles; the watchdog must report it.

    `what` is a key of `SPOILT`; the watchdog checks after a number of time `steps`.
    """
    scene, engine, recorder = watched(scene_data(access, shape_change(), count=3), out)
    # A few diameters apart, so that no smarticle falls on another.
    for k in range(3):
        add(engine, (0, 0, lying(scene) + 1e-5 + 3 * k * scene.body.radius))
    engine.advance(10)
    if articulated:
        engine.motors.articulate()
    before = watchdog_error(engine, recorder)
    access.spoil(engine, what)
    rigid = access.pin_stiffness(scene) == math.inf
    try:
        # With rigid hinges, no further step is needed to move the other links of the smarticle.
        engine.advance(0 if articulated and rigid and what in PLACES else steps)
        message = watchdog_error(engine, recorder)
    except RunError as error:
        message = str(error)
    # A link moved out of the container first exceeds the largest gap of its hinge.
    torn = articulated and not rigid and what in PLACES
    expected = "1 smarticle(s) (1): " if torn else SPOILT[what]
    if what == "overlap" and rigid:
        # On links the two have separated before the next check, which then reports their energy.
        expected = " smarticle(s) (0, 1"
    return [nothing("the check before reports", before), says(message, expected)]


for _what in SPOILT:
    for _hinged in (False, True):
        if (_what, _hinged) in {("hinge", False), ("overlap", True)}:
            continue  # welded smarticles have no hinges; a link moved alone exceeds the gap of its hinge first
        # The nodes of a hinge move in the next step, and its bond is checked in the step after.
        _steps = 3 if _what == "overlap" else 2 if _hinged and _what in (*PLACES, "hinge") else 0
        _size = {"what": _what, "articulated": _hinged, "steps": _steps}
        _absent = {"links": "hinges cannot part, there is none to tear"} if _what == "hinge" else {}
        _name = f"spoilt: {_what}, {'articulated' if _hinged else 'welded'}"
        hard(_name, _size, absent=_absent)(spoil)
        if _what in ("velocity", "spin"):
            hard(f"{_name}, some steps before", {**_size, "steps": 5})(spoil)


def _resting(access: EngineAccess, out: Path, count: int) -> tuple[Engine, Recorder]:
    """Let a stack of smarticles come to rest; return the engine, and the recorder with its watchdog."""
    scene, engine, recorder = watched(scene_data(access, count=count), out)
    for k in range(count):
        add(engine, (0, 0, lying(scene) * (2 * k + 1) + 1e-5))
    for _ in range(10):
        engine.advance(round(0.02 / engine.time_step))
        assert watchdog_error(engine, recorder) is None
    return engine, recorder


@hard("spoilt: pile that is heated", {"count": 4, "share": 0.3})
def heated(access: EngineAccess, out: Path, *, count: int, share: float) -> list[Check]:
    """Multiply the normal damping of a pile at rest by −`share`; the watchdog must report growing energy."""
    engine, recorder = _resting(access, out, count)
    access.heat(engine, share)
    access.push(engine, count - 1, velocity=(0, 0, 1e-3))
    message, fast, start = None, 0.0, engine.time
    while not message and engine.time < start + 5.0:
        engine.advance(round(recorder.interval / engine.time_step))
        fast = fastest(engine)
        message = watchdog_error(engine, recorder)
    return [
        says(message, "an energy that has risen by", "more than gravity, motors and springs explain", "lower fidelity"),
        below("greatest speed then, over the limit of speed [1]", fast / recorder.watchdog.speed, 0.5),
    ]


@hard("spoilt: pile that is kicked", {"count": 4, "speed": 0.3})
def kicked(access: EngineAccess, out: Path, *, count: int, speed: float) -> list[Check]:
    """Give a pile at rest an upward velocity below the limit; the watchdog must report the sudden energy."""
    engine, recorder = _resting(access, out, count)
    for k in range(count):
        access.push(engine, k, velocity=(0, 0, speed))
    return [
        says(watchdog_error(engine, recorder), f"{count} smarticle(s) (0, 1", "an energy that has risen by"),
        below("speed over the limit of speed [1]", speed / recorder.watchdog.speed, 0.2),
    ]


@hard("spoilt: contacts too soft", {"stiffness": 0.5})
def soft(access: EngineAccess, out: Path, *, stiffness: float) -> list[Check]:
    """Run with contacts too soft to stop a fall: the engine `links` rejects the scene, YADE stops the run."""
    run = whole(scene_data(access, RELAX, fidelity={"base": "draft", "stiffness_N_per_m": stiffness}), out)
    if access.name == "links":
        return [says(run.text, "fidelity.stiffness_N_per_m: at 0.5 N/m", "use about", "N/m")]
    return [says(run.text, "at t = ", "raise fidelity.stiffness_N_per_m")]


@hard("spoilt: time step 2 of the stable one", {"factor": 2.0, "count": 6, "seconds": 0.3}, {"count": 40})
# A long case: welded smarticles chatter and never settle, so that the pour waits until its time limit.
@hard("spoilt: time step 4 of the stable one", None, {"factor": 4.0, "count": 6, "seconds": 0.3})
def wrong_step(access: EngineAccess, out: Path, *, factor: float, count: int, seconds: float) -> list[Check]:
    """Run for some `seconds` at `factor` times the stable time step, which the run must report.

    The error must name a checkpoint. A few welded smarticles chatter on the spot: there the log must warn of it.
    """
    fidelity = "draft" if access.name == "yade" else {"base": "draft", "control_interval_s": LONG_CONTROL}
    recording = {"checkpoint_interval_s": 0.02}
    data = scene_data(access, swing(seconds), count=count, fidelity=fidelity, recording=recording)

    def steps(scene: Scene) -> list[float]:
        control = scene.fidelity.control_interval_s  # a multiple of the time step
        return [control / max(1, math.floor(control / (factor * stable_step(scene))))] * len(scene.phases)

    run = whole(data, out, steps=steps)
    if run.error is None:
        return [says((out / LOG).read_text(), "contact forces still fluctuate", "counts as settled")]
    kind = run.error[0]
    return [Check("kind of error", kind, "RunError", kind == "RunError"), says(run.text, "(last good checkpoint: ")]


@hard("spoilt: late in a run", {})
def late(access: EngineAccess, out: Path) -> list[Check]:
    """Give a smarticle 100 m/s at 0.55 s; message and `failed.json` must name the last checkpoint."""
    relax, recording = {"type": "relax", "duration_s": 0.4}, {"checkpoint_interval_s": 0.1}

    def throw(engine: Engine) -> None:
        if engine.time > 0.55:
            access.push(engine, 2, velocity=(0, 0, 100))

    run = whole(scene_data(access, relax, recording=recording), out, spoil=throw)
    text = (out / FAILED).read_text(encoding="utf-8") if (out / FAILED).exists() else None
    return [
        says(run.text, "1 smarticle(s) (2): a speed above", "(last good checkpoint: t = 0.5000 s)"),
        says(text, '"status": "failed"', '"checkpoint_s": 0.'),
    ]


def cost(access: EngineAccess, out: Path, *, fidelity: str, count: int, activity: str, seconds: float) -> list[Check]:
    """Check that the watchdog takes a small share of the processor time of a run.

    Its first check is measured separately, since it loads compiled code and would dominate the share of a short run.
    `activity` is "at rest", "shaken" or "swinging"; it lasts `seconds`.
    """
    phases: dict[str, dict[str, Any]] = {
        "at rest": {"type": "relax"},
        "shaken": {"type": "shake", "frequency_hz": 30, "peak_acceleration_g": 2},
        "swinging": {"type": "internal-oscillation", "theta_deg": 10},
    }
    phase = {**phases[activity], "duration_s": seconds}
    run = whole(scene_data(access, phase, count=count, per_layer=10, fidelity=fidelity), out, note=False)
    return [
        Check("ends", run.text or "done", "done", run.error is None),
        below("share of the processor time, but for the first check [1]", run.cost, 0.01),
        below("processor time of the first check [s]", run.first_check, 0.2),
    ]


for _fidelity in ("draft", "standard"):
    for _activity in ("at rest", "shaken", "swinging")[: 3 if _fidelity == "draft" else 2]:
        _run = {"fidelity": _fidelity, "count": 100, "activity": _activity, "seconds": 1.0}
        hard(f"cost of the watchdog, {_activity}, {_fidelity}", None, _run)(cost)
