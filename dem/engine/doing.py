"""What smarticles do in a phase, as far as it decides what a simulated second costs."""

from __future__ import annotations

from enum import StrEnum


class Doing(StrEnum):
    """From what is done to the pile."""

    POUR = "pour"
    REST = "rest"
    SHAKE = "shake"
    ACTUATE = "actuate"
