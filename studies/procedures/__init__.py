"""The study `procedures`: shape change, external and internal oscillation, against Savoie et al."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.procedures.study import Procedures


def _load(*, quick: bool) -> Procedures:
    from studies.procedures.study import Procedures  # noqa: PLC0415  (pandas, matplotlib)

    return Procedures()


SHIPPED = Shipped(
    name="procedures",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
shape change, external and internal oscillation of smarticles of several l/w, the latter with several
amplitudes θ too, against the findings of Savoie et al. (Soft Matter 2023): packing fraction, entanglement,
energy, height. 87 runs, seed by seed, so that what is finished covers all points; θ that the hinge cannot
reach at a small l/w are left out. --quick takes minutes.""",
)
