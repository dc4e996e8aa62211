"""Strings: springs with a dashpot that pull and never push."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class StringLaw:
    """What both strings have in common.

    Args:
        length: unstretched [m].
        stiffness: when taut [N/m].
        damping: when taut [N s/m].
    """

    length: float
    stiffness: float
    damping: float

    def tension(self, length: float, rate: float) -> float:
        """Tension [N] at a length [m] that grows at a rate [m/s]; 0 for a string that hangs."""
        stretch = length - self.length
        return max(0.0, self.stiffness * stretch + self.damping * rate) if stretch > 0 else 0.0
