"""The effects that a scene may call for, by name, and what one adds to a run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from enum import StrEnum
from itertools import chain


class EffectName(StrEnum):
    """Every effect, as `smarticles plan` prints it, in that order."""

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
    ENERGIES = "energies"
    ENERGY_ACCOUNT = "energy account"
    SERIES = "series"
    FRAMES = "frames"
    CONTACT_FORCES = "contact forces"
    SPHERE_GLYPHS = "sphere glyphs"
    CHECKPOINTS = "checkpoints"


@dataclass(frozen=True, kw_only=True)
class Adds:
    """What an effect adds to a run; nothing of it exists in a run without the effect."""

    engines: tuple[str, ...] = ()  #: What an engine runs in every step, by its own names
    functors: tuple[str, ...] = ()  #: What these are given to work with
    materials: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()  #: Kinds of bodies
    series: tuple[str, ...] = ()  #: Datasets of `series.h5`
    arrays: tuple[str, ...] = ()  #: Cell data of every frame
    files: tuple[str, ...] = ()
    python: str = ""  #: What Python does for it, how often, and other costs

    @staticmethod
    def together(parts: Iterable[Adds]) -> Adds:
        """Return the union, in order of mention."""
        each = list(parts)
        names = [field.name for field in fields(Adds) if field.name != "python"]
        lists = {
            name: tuple(dict.fromkeys(chain.from_iterable(getattr(part, name) for part in each))) for name in names
        }
        return Adds(**lists, python="; ".join(part.python for part in each if part.python))

    def to_text(self) -> str:
        """Return one line, with the number of entries of lists that are long; empty for nothing."""
        named = {"engines": self.engines, "materials": self.materials, "bodies": self.shapes, "files": self.files}
        counted = {"functors": self.functors, "datasets": self.series, "arrays per frame": self.arrays}
        parts = [f"{what} {', '.join(names)}" for what, names in named.items() if names]
        parts += [f"{len(names)} {what}" for what, names in counted.items() if names]
        return "; ".join(filter(None, [*parts, self.python]))
