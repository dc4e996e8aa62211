"""What simulators of other people can be told of a scene: passive phases alone, of chains of spheres in a cylinder."""

from __future__ import annotations

from collections.abc import Iterator

from dem.phases.phase import SceneView
from dem.phases.remove_container import RemoveContainer


def foreign(scene: SceneView) -> Iterator[str]:
    """What cannot be told, by key and name."""
    if scene.plane is not None:
        yield "plane: motion in a plane"
    if scene.hooks is not None:
        yield "hooks"
    if scene.cylinder.upper:
        yield "container.tiers"
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, RemoveContainer) and phase.speed_m_per_s is not None:
            yield f"phases.{index}.speed_m_per_s: a wall that is lifted (use null, gone at once)"
        elif phase.actuates:
            yield f"phases.{index} ({phase.kind}): motors"


def check_carried(scene: SceneView) -> None:
    """Refuse what the engine lammps cannot compute, all of it by name.

    Raises:
        ValueError: one line with keys and the way out.
    """
    found = list(foreign(scene))
    if scene.recording.energy:
        found.append("recording.energy: the work of the container is not added up")
    if scene.recording.dissipation_interval_s is not None:
        found.append("recording.dissipation_interval_s: what contacts dissipate is not added up")
    if scene.recording.contact_forces:
        found.append("recording.contact_forces: forces at contacts are not read from it")
    if found:
        msg = f"engine: lammps cannot compute {'; '.join(found)}; leave that out, or use engine: yade or links"
        raise ValueError(msg)
