"""The studies `chain` and `chain-bodies`: strain tests of a chain of robots between two walls, against Savoie et al."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.chain.study import Chain


def _load(*, quick: bool) -> Chain:
    from studies.chain.study import Chain  # noqa: PLC0415  (pandas, matplotlib)

    return Chain("chain")


def _load_bodies(*, quick: bool) -> Chain:
    from studies.chain.study import Chain  # noqa: PLC0415  (pandas, matplotlib)

    return Chain("chain-bodies")


SHIPPED = Shipped(
    name="chain",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"variant": "baseline", "count": 2, "h_over_H": 0.8},
    about="""\
strain test of a chain of two or six robots between two walls, against the findings of Savoie et al. (Soft Matter
2023): force, yield, width, fracture against confinement; and what friction, servos and strings, which the paper
does not tell, matter. 144 runs, on links, trial by trial. --quick takes minutes.""",
)

BODIES = Shipped(
    name="chain-bodies",
    folder=Path(__file__).parent,
    load=_load_bodies,
    pictured={"variant": "baseline", "count": 2, "h_over_H": 0.65},
    about="""\
the same of robots with bodies 2.1 cm thick, between walls where the paper's are, which then act in its range of
confinement. 64 runs, seed by seed, on YADE alone.""",
)
