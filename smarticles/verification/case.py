"""What is simulated to be checked: cases, and ladders over the time step."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from smarticles.verification.check import Answer, Check

Size = Literal["short", "long"]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A small simulation, and what must come out of it.

    Args:
        name: short, unique in its catalogue.
        about: what happens in it.
        run: simulates and checks, where YADE may be loaded; of a known answer without, of a hard case with a folder.
        theory: formula, and where it is from, where the answer is known.
        short: its size in continuous integration; None: the long form only.
        long: what differs from that in the long form; None: there is no other.
    """

    name: str
    about: str
    run: Callable[..., list[Answer]] | Callable[..., list[Check]]
    theory: str = ""
    short: Mapping[str, Any] | None = field(default_factory=dict)
    long: Mapping[str, Any] | None = None

    def answers(self) -> list[Answer]:
        """Run it, and compare with theory."""
        return [found for found in self.run() if isinstance(found, Answer)]

    def checks(self, size: Size, out: Path) -> tuple[list[Check], float]:
        """Run it in a folder and check it; with the wall time [s] that this took."""
        begun = time.monotonic()
        options = {**(self.short or {}), **((self.long or {}) if size == "long" else {})}
        found = [one for one in self.run(out, **options) if isinstance(one, Check)]
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
        order: of the scheme, in this motion [1].
        why: where that order is from.
        steps: from coarse to fine [s].
        errors: of each of these steps [unit].
    """

    name: str
    about: str
    quantity: str
    unit: str
    size: float
    order: int
    why: str
    steps: tuple[float, ...]
    errors: Callable[[Sequence[float]], list[float]]
