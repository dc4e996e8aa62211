"""Time steps of phases, from the engine's stable step and from intervals that are multiples of steps."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from dem.engine.kinds import engine_kind
from dem.errors import InputError, rounded_down
from dem.plan.ends import check_ends
from dem.scene.scene import Scene
from dem.scene.stiffness import too_soft
from dem.setting.span import Span
from dem.strict import SAME, unit_of

# Largest distance, in sphere diameters, by which boundaries may move in a step. Measured with a hook
# pulled out of piles of 30, draft and standard, 3 to 4 seeds: the deepest contact is 0.29 to 0.55 diameters deep at
# 0.03, 0.42 to 0.70 at 0.05 and 0.61 to 0.66 at 0.1, where the watchdog's limit is 0.5; at 0.3 the hook leaves the pile
# behind.
MOST_PER_STEP = 0.05
# On links, steps are shorter by the factor SHORTER at a restitution above LASTING, where the errors of many impacts add
# up: 0.5 s after four smarticles were thrown at 2.3 m/s, their energy is wrong by 1.3 % at 0.97, and by 0.1 % with half
# the step; by 0.1 % at 0.95.
LASTING, SHORTER = 0.95, 0.5


def stable_step(scene: Scene) -> float:
    """Return the largest stable time step [s] of a scene.

    If any phase has motors, it is the step for smarticles with hinges; otherwise for rigid smarticles.
    """
    return engine_kind(scene.engine).stable_step(scene, articulated=scene.actuates)


def time_step(scene: Scene) -> float:
    """Return the time step [s] of a scene, a whole fraction of its recording and control intervals.

    InputError if `fidelity.time_step_s` is above the stable step, contacts on the engine links are too soft, or a
    servo's control interval has more than one step.
    """
    # On links the barrier bears any load, but large overlaps need many sub-steps.
    if scene.smooth and (soft := too_soft(scene)):
        msg = f"{soft}, or leave it out"
        raise InputError(msg)
    stable = stable_step(scene)
    given = scene.fidelity.time_step_s
    if given is not None and given > stable:
        # Half a percent less, so that the three digits are not above it.
        raise InputError(
            f"fidelity.time_step_s: {given:g} s is above the stable step {stable:.4g} s of this smarticle at "
            f"{scene.fidelity.stiffness_N_per_m:g} N/m; use at most {0.995 * stable:.3g} s or leave it out"
        )
    wanted = given if given is not None else _fraction(scene) * stable
    whole = scene.fidelity.control_interval_s if scene.actuates else scene.recording.series_interval_s
    steps = _steps_in(whole, wanted)
    if scene.actuates and scene.motor.law == "servo" and steps > 1 and engine_kind(scene.engine).damps_once_per_update:
        # A damper that acts a period late drives vibrations that are faster than the period.
        raise InputError(
            f"fidelity.control_interval_s: {whole:g} s is {steps} time steps, but a servo (motor.law) must damp in "
            f"each; use at most {rounded_down(wanted)} s, or softer contacts, servos and strings"
        )
    return whole / steps


def time_steps(scene: Scene) -> tuple[float, ...]:
    """Return the time step [s] of each phase.

    All phases have the step of `time_step`, with two exceptions. Phases before the first one with motors have the
    longer step of a scene without motors, since their smarticles are still rigid in the initial shape. Their results
    are bitwise equal to those of that scene. Smarticles that are welded later keep the barb angles that their motors
    reached, for which the longer step is not known to be stable. In a plane, or if `fidelity.time_step_s` is given,
    there is no such exception. The other one are phases whose drive needs a shorter step, see `limiting_spans`.

    InputError as in `time_step`, or if `fidelity.time_step_s` is too long for a drive, or bars have holes, or a wall,
    hook, string or shaking moves too fast for the step of its phase, or the scene cannot end, see `dem.plan.ends`.
    """
    if holes := scene.sections.holes(scene.fidelity.rows, scene.least_rows):
        raise InputError(holes)
    steps = tuple(_resolved(scene, index, step)[0] for index, step in enumerate(_stable_steps(scene)))
    _check_speeds(scene, steps)
    check_ends(scene)
    return steps


def limiting_spans(scene: Scene) -> tuple[Span | None, ...]:
    """Return, for each phase, the span that makes its time step shorter; None where stability decides it."""
    return tuple(_resolved(scene, index, step)[1] for index, step in enumerate(_stable_steps(scene)))


def _stable_steps(scene: Scene) -> tuple[float, ...]:
    """Return the time step [s] of each phase as stability decides it."""
    count, shortest = len(scene.phases), time_step(scene)
    first = next((k for k, phase in enumerate(scene.phases) if phase.actuates), count)
    if scene.fidelity.time_step_s is not None or scene.plane is not None or first == count:
        return (shortest,) * count
    whole = scene.recording.series_interval_s
    stable = engine_kind(scene.engine).stable_step(scene, articulated=False)
    poured = whole / _steps_in(whole, _fraction(scene) * stable)
    return (poured,) * first + (shortest,) * (count - first)


def _spans_of(scene: Scene, index: int) -> tuple[Span, ...]:
    """Return the spans of a phase, and of active bending that goes on from an earlier one, with keys of the scene."""
    phases, going_on = scene.phases, index
    while going_on and not (phases[going_on].stills or phases[going_on].bends):
        going_on -= 1
    numbers = dict.fromkeys((index, *([going_on] if phases[going_on].bends else [])))
    return tuple(replace(span, key=f"phases.{k}.{span.key}") for k in numbers for span in phases[k].spans())


def _resolved(scene: Scene, index: int, step: float) -> tuple[float, Span | None]:
    """Return the longest step up to `step` [s] that resolves all spans of a phase, and the span that decides it.

    InputError if `fidelity.time_step_s` is given, and is too long.
    """
    given, phase, limit = scene.fidelity.time_step_s, scene.phases[index], None
    for span in sorted(_spans_of(scene, index), key=lambda span: span.whole):
        if span.longest_step < step * (1 - SAME):
            if given is not None:
                raise InputError(
                    f"fidelity.time_step_s: {given:g} s makes {span.seconds / step:.3g} time steps in the "
                    f"{span.seconds:.3g} s of {span.key} ({span.value}), and {span.steps} resolve it; use at most "
                    f"{rounded_down(span.longest_step)} s or leave it out"
                )
            interval = scene.fidelity.control_interval_s if phase.actuates else scene.recording.series_interval_s
            step, limit = interval / _steps_in(interval, span.longest_step), span
        if span.whole and (divided := span.divided(step)) < step * (1 - SAME):
            step, limit = divided, span
    return step, limit


def _fraction(scene: Scene) -> float:
    """Return the time step over the stable step [1] of a scene without `fidelity.time_step_s`."""
    shorter = SHORTER if scene.smooth and scene.contact.restitution > LASTING else 1.0
    return scene.fidelity.time_step_fraction * shorter


def _steps_in(interval: float, wanted: float) -> int:
    """Return the number of equal time steps in an interval [s], none longer than `wanted` [s]."""
    return max(1, math.ceil(interval / wanted * (1 - 1e-12)))


def _check_speeds(scene: Scene, steps: Sequence[float]) -> None:
    """Raise InputError if boundaries or strings move so fast in a time step that contacts cannot follow."""
    diameter = scene.sphere_diameter
    for index, (phase, step) in enumerate(zip(scene.phases, steps, strict=True)):
        most, gravity, vibration = MOST_PER_STEP * diameter / step, scene.gravity_m_per_s2, phase.vibrated_by
        moving: list[tuple[str, float, Any]] = [(phase.speed_key, phase.pushing_speed(gravity), phase)]
        if vibration is not None:
            moving.append(("peak_acceleration_g", vibration.peak_speed(gravity), vibration))
        for key, speed, part in moving:
            if speed <= most:
                continue
            unit, value = unit_of(key)[1], getattr(part, key)
            where = key if part is phase else f"vibration.{key}"
            # Half a percent less, so that the three digits are not above it.
            raise InputError(
                f"phases.{index}.{where}: {value:g} {unit} ({phase.kind}) is {speed * step / diameter:.3g} sphere "
                f"diameters in a time step of {step:.3g} s, which contacts cannot follow; use at most "
                f"{0.995 * value * most / speed:.3g} {unit} or a shorter fidelity.time_step_s"
            )
