"""The studies `melting` and `melting-code`: piles whose wall is taken away, by the paper's text and by its code."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.melting.study import Melting


def _load(*, quick: bool) -> Melting:
    from studies.melting.study import Melting  # noqa: PLC0415  (pandas, matplotlib)

    return Melting("melting")


def _load_code(*, quick: bool) -> Melting:
    from studies.melting.study import Melting  # noqa: PLC0415  (pandas, matplotlib)

    return Melting("melting-code")


SHIPPED = Shipped(
    name="melting",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "shape-change", "lift_m_per_s": 0, "l_over_w": 0.7},
    about="""\
the container's wall is taken away, at once or lifted, after shape change, internal or external oscillation or
none: what holds together, spreads, comes off or falls over within 2 s, against the text of Savoie et al.
136 runs, seed by seed; --quick takes minutes.""",
)

CODE = Shipped(
    name="melting-code",
    folder=Path(__file__).parent,
    load=_load_code,
    pictured={"procedure": "shape-change", "lift_m_per_s": 0, "l_over_w": 0.7},
    about="""\
the same by the rules of the paper's own code: a motor at its torque limit goes on at half the speed and stops after
20 findings in a row, friction 0.2, the floor shaken alone.""",
)
