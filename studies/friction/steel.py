"""Coefficients of friction of dry steel on steel, as published; they differ by more than the study can tell apart.

Blau, Tribology International 34 (2001) 585: a coefficient of friction belongs to a whole system of surfaces, films and
loads, and tabulated ones mislead where that is ignored. What Gravish's staples are coated with is not known to us.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Published:
    """A published coefficient of friction of dry steel on steel.

    Attributes:
        surface: What the steel was like.
        low: Static coefficient [-].
        high: The same, where there is a range [-].
        source: Where it stands.
    """

    surface: str
    low: float
    high: float
    source: str


_BERKELEY = "Lawrence Berkeley National Laboratory, Engineering, A. J. DeMello, Coefficient of Friction"

AS_IT_COMES = (
    Published(surface="dry", low=0.12, high=0.60, source="Lust, Engineering Guide CDA3000, table 7.21"),
    Published(
        surface="dry", low=0.15, high=0.30, source=f"Gieck, Technical Formulae, 7th ed., as cited by {_BERKELEY}"
    ),
    Published(surface="with a thick film of oxide", low=0.27, high=0.27, source=_BERKELEY),
    Published(
        surface="AISI 1032 on itself",
        low=0.31,
        high=0.31,
        source=f"Davis, Concise Metals Data Handbook, table 14.1, as cited by {_BERKELEY}",
    ),
)
"""Static coefficients of surfaces that nobody says were cleaned."""

CLEANED = (
    Published(surface="clean and dry", low=0.78, high=0.78, source=_BERKELEY),
    Published(surface="mild steel, dry", low=0.74, high=0.74, source=_BERKELEY),
)
"""Static coefficients of clean surfaces."""


def spanned(published: tuple[Published, ...]) -> tuple[float, float]:
    """The lowest and the highest of published values [-]."""
    return min(one.low for one in published), max(one.high for one in published)
