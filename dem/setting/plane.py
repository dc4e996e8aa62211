"""Motion confined to a horizontal plane, between two parallel walls instead of in a container.

Robots lie flat on a table: they move along x and y and turn about z, and nothing else. The table carries their weight
and does not rub. Only the inertia about z matters then, so that YADE may integrate rotations as those of a sphere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import Field, field_validator

from dem.engine.yade.library import Yade
from dem.setting.container import WALL_MATERIAL
from dem.setting.part import Part, refuse_wrong_unit

if TYPE_CHECKING:
    from dem.scene.scene import Scene

ONLY_HERE = ("arrange", "strain")
PHASES = (*ONLY_HERE, "relax", "actuate", "shape-change", "internal-oscillation")


class Plane(Part):
    """Smarticles lie flat on a table that carries them without friction, and stay in the plane; no container."""

    width_m: float | None = Field(
        None, gt=0, description="H, distance between two walls along x that confine them [m]; null: no walls"
    )

    _length_unit = field_validator("width_m")(refuse_wrong_unit)


@dataclass(frozen=True, kw_only=True)
class Channel:
    """Table and walls as the engine builds them. Lengths in m.

    Args:
        width: between the walls; None: there are none.
        table: height of the table below the plane of the centrelines, negative.
    """

    width: float | None
    table: float


def add_channel(yade: Yade, channel: Channel) -> list[int]:
    """Add walls and table, the centrelines' plane at z = 0.

    Returns:
        Ids of the lower and the upper wall, where there are walls, and of the table last.
    """
    bodies = []
    if channel.width is not None:
        # As the container's floor, each pushes to its own side whatever happens.
        for side in (-1, 1):
            place = side * channel.width / 2
            bodies.append(yade.utils.wall(place, axis=1, sense=-side, material=WALL_MATERIAL))
    bodies.append(yade.utils.wall(channel.table, axis=2, sense=1, material=WALL_MATERIAL))
    return [int(yade.omega.bodies.append(body)) for body in bodies]


def check_plane(scene: Scene) -> None:
    """Check that a scene in the plane asks for nothing that needs the third direction, and others for no chain.

    Raises:
        ValueError: one line with key, value and the way out.
    """
    if scene.plane is None:
        for index, phase in enumerate(scene.phases):
            if phase.type in ONLY_HERE:
                msg = f"phases.{index}: {phase.type} needs motion confined to a plane; add the key plane"
                raise ValueError(msg)
        return
    for index, phase in enumerate(scene.phases):
        if phase.type not in PHASES:
            msg = f"phases.{index}: {phase.type} has no meaning in a plane; use {', '.join(PHASES)}, or leave plane out"
            raise ValueError(msg)
        if (phase.type == "arrange") != (index == 0):
            msg = f"phases.{index}: {phase.type}; a run in a plane starts with one 'arrange' and has no other"
            raise ValueError(msg)
    if scene.hooks is not None:
        msg = "hooks: they lie out of the plane; leave hooks or plane out"
        raise ValueError(msg)
    if scene.container != type(scene.container)():
        msg = "container: a plane has none but two walls; leave container out and give plane.width_m"
        raise ValueError(msg)
    if scene.fidelity.rows != 1:
        msg = f"fidelity.rows: {scene.fidelity.rows} rows of spheres out of the plane; use 1"
        raise ValueError(msg)
