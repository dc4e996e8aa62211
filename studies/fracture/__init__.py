"""The studies `fracture` and `fracture-code`: a hook pulled out of piles, by the paper's text and by its code."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.fracture.study import Fracture


def _load(*, quick: bool) -> Fracture:
    from studies.fracture.study import Fracture  # noqa: PLC0415  (pandas, matplotlib)

    return Fracture("fracture")


def _load_code(*, quick: bool) -> Fracture:
    from studies.fracture.study import Fracture  # noqa: PLC0415  (pandas, matplotlib)

    return Fracture("fracture-code")


SHIPPED = Shipped(
    name="fracture",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
a hook is pulled out of piles that were prepared by each procedure, by internal oscillation of several
amplitudes θ, and of several l/w, against the findings of Savoie et al. (Soft Matter 2023) on tensile loading:
force against time, peak force, work, and how they go with entanglement. 128 runs of the paper's numbers of
smarticles, seed by seed; --quick takes minutes.""",
)

CODE = Shipped(
    name="fracture-code",
    folder=Path(__file__).parent,
    load=_load_code,
    pictured={"procedure": "shape-change", "l_over_w": 0.7},
    about="""\
the same by the rules of the paper's own code: a motor at its torque limit goes on at half the speed and stops after
20 findings in a row, friction 0.2, the floor shaken alone.""",
)
