"""Names of the effects that a scene may need, and what an effect adds to a run.

An effect is a physical process that is simulated only where needed, such as friction or motors, or a kind of recorded
data, such as frames or energies.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from enum import StrEnum
from itertools import chain


class EffectName(StrEnum):
    """Names of all effects, in the order in which `smarticles plan` prints them."""

    CONTACT = "contact"
    CONTAINER = "container"
    PLANE = "plane"
    STRINGS = "strings"
    GRAVITY = "gravity"
    FRICTION = "friction"
    RESTITUTION = "restitution"
    CONTAINER_MOTION = "container motion"
    ARTICULATION = "articulation"
    MOTORS = "motors"
    TORQUE_CAP = "torque cap"
    HOOKS = "hooks"
    WALL_REMOVAL = "wall removal"
    PLATE = "plate"
    GRIPS = "grips"
    FILAMENTS = "filaments"
    JOINTS = "joints"
    ENERGIES = "energies"
    ENERGY_ACCOUNT = "energy account"
    SERIES = "series"
    FRAMES = "frames"
    CONTACT_FORCES = "contact forces"
    SPHERE_GLYPHS = "sphere glyphs"
    CHECKPOINTS = "checkpoints"


@dataclass(frozen=True, kw_only=True)
class Adds:
    """Objects, data and work that an effect adds to a run; a run without the effect has none of them."""

    engines: tuple[str, ...] = ()  #: Parts of the engine that run in every step, in the engine's own terms
    functors: tuple[str, ...] = ()  #: Names of YADE's functors
    materials: tuple[str, ...] = ()  #: Names of YADE's materials
    shapes: tuple[str, ...] = ()  #: Geometries that represent bodies and boundaries, in words
    series: tuple[str, ...] = ()  #: Names of datasets of `series.h5`
    arrays: tuple[str, ...] = ()  #: Names of cell data of every frame
    files: tuple[str, ...] = ()  #: Names of files of the run directory
    python: str = ""  #: Work in Python with its frequency, and other costs, in words

    @staticmethod
    def together(parts: Iterable[Adds]) -> Adds:
        """Return the union of several effects' additions, in the order of `parts`."""
        each = list(parts)
        names = [field.name for field in fields(Adds) if field.name != "python"]
        lists = {
            name: tuple(dict.fromkeys(chain.from_iterable(getattr(part, name) for part in each))) for name in names
        }
        return Adds(**lists, python="; ".join(part.python for part in each if part.python))

    def to_text(self, *, internals: bool = True) -> str:
        """Return a line that describes the additions; "" if there are none.

        Engines, materials, shapes and files are named; functors, datasets and arrays are counted; `python` comes last.
        Without `internals` the line leaves out what is in the engine's own terms.
        """
        named = {"files": self.files}
        counted = {"datasets": self.series, "arrays per frame": self.arrays}
        if internals:
            named = {"engines": self.engines, "materials": self.materials, "bodies": self.shapes, **named}
            counted = {"functors": self.functors, **counted}
        parts = [f"{what} {', '.join(names)}" for what, names in named.items() if names]
        parts += [f"{len(names)} {what}" for what, names in counted.items() if names]
        return "; ".join(filter(None, [*parts, self.python]))
