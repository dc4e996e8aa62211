"""The studies `sensitivity` and `sensitivity-section`: what φ owes to each choice of the contact model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.sensitivity.study import Sensitivity


def _load(*, quick: bool) -> Sensitivity:
    from studies.sensitivity.study import Sensitivity  # noqa: PLC0415  (pandas, matplotlib)

    return Sensitivity("sensitivity")


def _load_section(*, quick: bool) -> Sensitivity:
    from studies.sensitivity.study import Sensitivity  # noqa: PLC0415  (pandas, matplotlib)

    return Sensitivity("sensitivity-section")


SHIPPED = Shipped(
    name="sensitivity",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"variant": "draft"},
    about="""\
what the packing fraction before and after shaking owes to restitution, friction, damping, stiffness and
sphere diameter, one at a time, at l/w = 0.7.""",
)

SECTION = Shipped(
    name="sensitivity-section",
    folder=Path(__file__).parent,
    load=_load_section,
    pictured={"variant": "draft"},
    about="""\
the same for pitch and rows of spheres, up to the true section.""",
)
