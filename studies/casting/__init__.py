"""The study `casting`: smarticles cast in a mould of three tiers, against Savoie et al."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.casting.study import Casting


def _load(*, quick: bool) -> Casting:
    from studies.casting.study import Casting  # noqa: PLC0415  (pandas, matplotlib)

    return Casting()


SHIPPED = Shipped(
    name="casting",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "internal"},
    about="""\
smarticles of l/w = 0.8 poured into a mould of three tiers, each narrower than the one below, and activated; the
walls go at once: how well each tier is filled before, and what is kept 1 s later. --quick takes minutes.""",
)
