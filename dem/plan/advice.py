"""What is no reason to refuse a scene and had better be known before it runs: one line each with the key."""

from __future__ import annotations

import math

from dem.engine.kinds import engine_kind
from dem.phases.shake import Shake
from dem.physics.contact import typical_effective_mass
from dem.scene.scene import Scene
from dem.setting.fidelity import Fidelity, fidelities

# Diameters: an overlap that a scene is warned of, and one up to which contacts are linear.
SOFT, LINEAR = 0.5, 0.25
_LEFT_OUT = {
    "series_interval_s": "one sample is taken, at the start",
    "frame_interval_s": "no frame is written",
    "sphere_interval_s": "no spheres are written",
}


def warnings_of(scene: Scene) -> tuple[str, ...]:
    """All warnings of a scene, for `plan` and for the beginning of a run: what, where, value with unit, way out."""
    of_phases = (warning for index, phase in enumerate(scene.phases) for warning in phase.warnings(scene, index))
    # What several phases say of one thing is said once.
    return (*dict.fromkeys(of_phases), *recording_warnings(scene), *engine_warnings(scene), *stiffness_warnings(scene))


def expected_overlaps(scene: Scene) -> tuple[float, float]:
    """Estimate overlaps [m]: of an impact at the scene's greatest speed on one contact, and under the pile's weight.

    The impact is that of `typical_effective_mass` after a fall by w, at the greatest speed that a phase gives besides.
    The weight, times 1 + Γ, is borne by as many contacts as smarticles can lie on the floor.
    """
    gravity, width, boxes = scene.gravity_m_per_s2, scene.smarticle.middle_length_m, scene.smarticle.boxes
    stiffness = scene.fidelity.stiffness_N_per_m
    given = max(phase.peak_speed(gravity) for phase in scene.phases)
    speed = math.sqrt(given**2 + 2 * gravity * width)
    shaken = max((phase.peak_acceleration_g for phase in scene.phases if isinstance(phase, Shake)), default=0.0)
    bearing = max(1.0, min(scene.count, math.pi * scene.cylinder.radius**2 / width**2))
    weight = scene.count * boxes.mass * gravity * (1 + shaken) / bearing
    return speed * math.sqrt(typical_effective_mass(scene.particle) / stiffness), weight / stiffness


def stiffness_warnings(scene: Scene) -> tuple[str, ...]:
    """Contacts that are likely to give way by more than half a diameter, with the stiffness that they need."""
    diameter = scene.sphere_diameter
    impact, weight = (depth / diameter for depth in expected_overlaps(scene))
    if max(impact, weight) <= SOFT:
        return ()
    # The overlap of an impact falls with the root of the stiffness.
    factor = max((impact / LINEAR) ** 2, weight / LINEAR)
    cause = "the hardest impact" if impact > weight else "the pile's weight"
    return (
        f"fidelity.stiffness_N_per_m: at {scene.fidelity.stiffness_N_per_m:g} N/m {cause} presses contacts in by about "
        f"{max(impact, weight):.2g} of their thickness; use about {factor * scene.fidelity.stiffness_N_per_m:.2g} N/m "
        f"for {LINEAR:g} of it",
    )


def engine_warnings(scene: Scene) -> tuple[str, ...]:
    """Knobs of the fidelity that are set and have no meaning on the scene's engine, in one line."""
    fidelity = scene.fidelity
    named = fidelities(scene.engine)[fidelity.base]
    usual = {key: named.get(key, Fidelity.model_fields[key].default) for key in engine_kind(scene.engine).idle_knobs}
    told = [f"{key} ({getattr(fidelity, key):g})" for key, value in usual.items() if getattr(fidelity, key) != value]
    if not told:
        return ()
    mean = "has no meaning" if len(told) == 1 else "have no meaning"
    return (f"fidelity: {', '.join(told)} {mean} on the engine {scene.engine}; leave out what does nothing",)


def recording_warnings(scene: Scene) -> tuple[str, ...]:
    """Intervals of recording that are longer than the run."""
    known = all(phase.known_duration is not None for phase in scene.phases)
    length = sum(phase.expected_duration(scene.count) for phase in scene.phases)
    run = f"the whole run, {'' if known else 'about '}{length:.3g} s"
    found = []
    for key, left_out in _LEFT_OUT.items():
        interval = getattr(scene.recording, key)
        if interval is not None and interval > length:
            found.append(
                f"recording.{key}: {interval:g} s is longer than {run}, so that {left_out}; shorten it, or lengthen "
                "the run"
            )
    return tuple(found)
