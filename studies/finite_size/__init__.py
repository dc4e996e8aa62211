"""The study `finite-size`: packing, entanglement and its percolation from 100 to 10 000 smarticles."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.finite_size.study import FiniteSize


def _load(*, quick: bool) -> FiniteSize:
    from studies.finite_size.study import FiniteSize  # noqa: PLC0415  (pandas, matplotlib)

    return FiniteSize()


SHIPPED = Shipped(
    name="finite-size",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"l_over_w": 0.7, "count": 1000},
    about="""\
piles of one shape and of 100 to 10 000 smarticles, poured and shaken: what the paper's 270 owe to their walls, and at
which l/w entangled clusters reach through a pile. 159 runs, an hour and a half on one core; --quick takes minutes.""",
)
