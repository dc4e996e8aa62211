"""The studies `strength` and `strength-code`: piles torn between a grip on the floor and a hook, without a wall."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.strength.study import Strength


def _load(*, quick: bool) -> Strength:
    from studies.strength.study import Strength  # noqa: PLC0415  (pandas, matplotlib)

    return Strength("strength")


def _load_code(*, quick: bool) -> Strength:
    from studies.strength.study import Strength  # noqa: PLC0415  (pandas, matplotlib)

    return Strength("strength-code")


SHIPPED = Shipped(
    name="strength",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "shape-change", "upper_m": 0.013},
    about="""\
piles prepared by each procedure are torn: a grid of bars holds them over the whole floor, the wall is taken away, the
hook of the paper is raised from two heights, farther from the grid than one smarticle reaches: force against
displacement, peak, work, what tears off, against Savoie et al. (Soft Matter 2023). 72 runs; --quick takes minutes.""",
)

CODE = Shipped(
    name="strength-code",
    folder=Path(__file__).parent,
    load=_load_code,
    pictured={"procedure": "shape-change", "upper_m": 0.013},
    about="""\
the same by the rules of the paper's own code: a motor at its torque limit goes on at half the speed and stops after
20 findings in a row, friction 0.2, the floor shaken alone.""",
)
