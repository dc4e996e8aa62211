"""Table and walls of motion in a plane, in YADE.

Only the inertia about z matters there, so that YADE may integrate rotations as those of a sphere.
"""

from __future__ import annotations

from dem.engine.yade.container import WALL_MATERIAL
from dem.engine.yade.library import Yade
from dem.setting.plane import Channel


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
