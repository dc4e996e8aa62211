"""Motion confined to a horizontal plane, between two parallel walls instead of in a container.

Robots lie flat on a table: they move along x and y and turn about z only. The table carries their weight without
friction.
"""

from dataclasses import dataclass

from pydantic import Field

from dem.setting.part import Length, Part


class Plane(Part):
    """A horizontal plane without container: smarticles lie flat on a table without friction."""

    width_m: Length | None = Field(
        None, description="H, distance between two walls along x that confine them [m]; null: no walls"
    )


@dataclass(frozen=True, kw_only=True)
class Channel:
    """Table and walls of a simulation in a plane. Lengths in m."""

    width: float | None  #: Distance between the walls; None: no walls
    table: float  #: Height of the table below the plane of the centrelines, negative
