"""What is no reason to refuse a scene and had better be known before it runs: one line each with the key."""

from __future__ import annotations

from dem.engine.kinds import engine_kind
from dem.scene.scene import Scene
from dem.setting.fidelity import Fidelity, fidelities

_LEFT_OUT = {
    "series_interval_s": "one sample is taken, at the start",
    "frame_interval_s": "no frame is written",
    "sphere_interval_s": "no spheres are written",
}


def warnings_of(scene: Scene) -> tuple[str, ...]:
    """All warnings of a scene, for `plan` and for the beginning of a run: what, where, value with unit, way out."""
    of_phases = (warning for index, phase in enumerate(scene.phases) for warning in phase.warnings(scene, index))
    # What several phases say of one thing is said once.
    return (*dict.fromkeys(of_phases), *recording_warnings(scene), *engine_warnings(scene))


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
