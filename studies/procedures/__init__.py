"""The studies `procedures` and `procedures-code`: what each does to a pile, by the paper's text and by its code."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.procedures.study import Procedures


def _load(*, quick: bool) -> Procedures:
    from studies.procedures.study import Procedures  # noqa: PLC0415  (pandas, matplotlib)

    return Procedures("procedures")


def _load_code(*, quick: bool) -> Procedures:
    from studies.procedures.study import Procedures  # noqa: PLC0415  (pandas, matplotlib)

    return Procedures("procedures-code")


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

CODE = Shipped(
    name="procedures-code",
    folder=Path(__file__).parent,
    load=_load_code,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
the same by the rules of the paper's own code: a motor at its torque limit goes on at half the speed and stops after
20 findings in a row, friction 0.2, the floor shaken alone.""",
)
