"""What is simulated to be checked: cases, and ladders over the time step."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from validation.check import Answer, Check
from validation.engines import engine_access

Size = Literal["short", "long"]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A small simulation, and what must come out of it.

    Args:
        name: short, unique in its catalogue.
        about: what happens in it.
        run: simulates with the access that it is given, and checks; a hard case is given a folder as well.
        theory: formula, and where it is from, where the answer is known.
        short: its size in continuous integration; None: the long form only.
        long: what differs from that in the long form; None: there is no other.
        absent: why it has no meaning, by engine.
    """

    name: str
    about: str
    run: Callable[..., list[Answer]] | Callable[..., list[Check]]
    theory: str = ""
    short: Mapping[str, Any] | None = field(default_factory=dict)
    long: Mapping[str, Any] | None = None
    absent: Mapping[str, str] = field(default_factory=dict)

    def answers(self, engine: str) -> list[Answer]:
        """Run it on an engine, and compare with theory."""
        return [found for found in self.run(engine_access(engine)) if isinstance(found, Answer)]

    def checks(self, engine: str, size: Size, out: Path) -> tuple[list[Check], float]:
        """Run it on an engine, in a folder, and check it; with the wall time [s] that this took."""
        begun = time.monotonic()
        options = {**(self.short or {}), **((self.long or {}) if size == "long" else {})}
        found = [one for one in self.run(engine_access(engine), out, **options) if isinstance(one, Check)]
        return found, time.monotonic() - begun


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """A trajectory at several time steps: how its error falls with the step.

    Args:
        name: short, unique.
        about: what moves.
        quantity: the error that is measured.
        unit: of it.
        size: of the motion, that errors are told in parts of [unit].
        scheme: order of the scheme in this motion [1], and where that order is from; by engine.
        steps: from coarse to fine [s].
        errors: of each of some steps [unit], by access.
    """

    name: str
    about: str
    quantity: str
    unit: str
    size: float
    scheme: Mapping[str, tuple[int, str]]
    steps: tuple[float, ...]
    errors: Callable[..., list[float]]
