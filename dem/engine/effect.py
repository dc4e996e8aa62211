"""Names of the effects that a scene may need, and what an effect adds to a run."""

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

    engines: tuple[str, ...] = ()  #: Parts of an engine that run in every step, by the engine's own names
    functors: tuple[str, ...] = ()  #: YADE's functors
    materials: tuple[str, ...] = ()  #: YADE's materials
    shapes: tuple[str, ...] = ()  #: Kinds of bodies
    series: tuple[str, ...] = ()  #: Datasets of `series.h5`
    arrays: tuple[str, ...] = ()  #: Cell data of every frame
    files: tuple[str, ...] = ()  #: Files of the run directory
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

    def to_text(self) -> str:
        """Return one line that names engines, materials, bodies and files and counts the rest; "" for nothing."""
        named = {"engines": self.engines, "materials": self.materials, "bodies": self.shapes, "files": self.files}
        counted = {"functors": self.functors, "datasets": self.series, "arrays per frame": self.arrays}
        parts = [f"{what} {', '.join(names)}" for what, names in named.items() if names]
        parts += [f"{len(names)} {what}" for what, names in counted.items() if names]
        return "; ".join(filter(None, [*parts, self.python]))
