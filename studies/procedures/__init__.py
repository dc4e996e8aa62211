"""The studies `procedures`, `procedures-code` on either engine, and `factors`: by text, by code, and one by one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.procedures.factors import Factors
    from studies.procedures.study import Procedures


def _load(*, quick: bool) -> Procedures:
    from studies.procedures.study import Procedures  # noqa: PLC0415  (pandas, matplotlib)

    return Procedures("procedures")


def _load_code(*, quick: bool) -> Procedures:
    from studies.procedures.study import Procedures  # noqa: PLC0415  (pandas, matplotlib)

    return Procedures("procedures-code")


def _load_code_on_yade(*, quick: bool) -> Procedures:
    from studies.procedures.study import Procedures  # noqa: PLC0415  (pandas, matplotlib)

    return Procedures("procedures-code-yade")


def _load_factors(*, quick: bool) -> Factors:
    from studies.procedures.factors import Factors  # noqa: PLC0415  (pandas, matplotlib)

    return Factors()


SHIPPED = Shipped(
    name="procedures",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
shape change, external and internal oscillation of smarticles of several l/w, the latter with several
amplitudes θ too, against the findings of Savoie et al. (Soft Matter 2023): packing fraction, entanglement,
energy, height. 326 runs at the paper's eight l/w and counts, seed by seed, so that what is finished covers all
points; θ that the hinge cannot reach at a small l/w are left out. --quick takes minutes.""",
)

CODE = Shipped(
    name="procedures-code",
    folder=Path(__file__).parent,
    load=_load_code,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
the same by the rules of the paper's own code: a motor at its torque limit goes on at half the speed and stops after
20 findings in a row, friction 0.2, a wall of 22.4 mm, the floor shaken alone.""",
)

CODE_ON_YADE = Shipped(
    name="procedures-code-yade",
    folder=Path(__file__).parent,
    load=_load_code_on_yade,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
what the main finding by the code's rules rests on, once more on YADE: shape change and internal oscillation of 100
smarticles at three aspect ratios; 18 runs.""",
)

FACTORS = Shipped(
    name="factors",
    folder=Path(__file__).parent,
    load=_load_factors,
    pictured={"protocol": "code", "law": "ease", "friction": 0.2, "l_over_w": 0.7},
    about="""\
which of these differences decides what a shape change leaves: all combinations of the motor's law, friction and the
wall's radius, at two l/w; 128 runs.""",
)
