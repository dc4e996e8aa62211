"""The studies `casting` and `casting-code`: smarticles cast in a mould, by the paper's text and by its code."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.casting.study import Casting


def _load(*, quick: bool) -> Casting:
    from studies.casting.study import Casting  # noqa: PLC0415  (pandas, matplotlib)

    return Casting("casting")


def _load_code(*, quick: bool) -> Casting:
    from studies.casting.study import Casting  # noqa: PLC0415  (pandas, matplotlib)

    return Casting("casting-code")


SHIPPED = Shipped(
    name="casting",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "internal"},
    about="""\
smarticles of l/w = 0.8 poured into a mould of three tiers, each narrower than the one below, and activated; the
walls go at once: how well each tier is filled before, and what is kept 1 s later. --quick takes minutes.""",
)

CODE = Shipped(
    name="casting-code",
    folder=Path(__file__).parent,
    load=_load_code,
    pictured={"procedure": "internal"},
    about="""\
the same by the rules of the paper's own code: a motor at its torque limit goes on at half the speed and stops after
20 findings in a row, friction 0.2.""",
)
