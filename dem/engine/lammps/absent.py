"""What LAMMPS has none of here: motors, strings, forces at contacts.

Scenes that call for them are refused before there is an engine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from dem.body.chain import Tie
from dem.engine.interface import MotorReadings
from dem.errors import RunError
from dem.physics.strings import StringLaw

Array = NDArray[np.float64]


def refuse(what: str) -> NoReturn:
    """Say that there is none.

    Raises:
        RunError: always.
    """
    msg = f"engine: lammps has no {what}"
    raise RunError(msg)


class NoMotors:
    """See `dem.engine.interface.Motors`: smarticles stay welded."""

    present = False
    articulated = False
    looks_at_once = 1
    readings: MotorReadings | None = None
    work = 0.0

    def articulate(self) -> None:
        """See the interface."""
        refuse("motors")

    def weld(self) -> None:
        """See the interface: they are."""

    def actuate(self, targets: Array, interval: float) -> None:
        """See the interface."""
        refuse("motors")

    def gaps(self) -> Array:
        """See the interface."""
        return np.zeros((0, 2))


class NoStrings:
    """See `dem.engine.interface.Strings`."""

    tied = False
    pulled = math.nan

    @property
    def sums(self) -> Array:
        """See the interface."""
        return np.zeros((0, 3))

    @property
    def ties(self) -> Array:
        """See the interface."""
        return np.zeros((0, 3))

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        """See the interface."""
        refuse("strings")

    def untie(self) -> None:
        """See the interface: there are none."""
