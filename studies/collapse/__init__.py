"""The study `collapse`: free-standing columns on a vibrating base, against Gravish et al. 2012."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.collapse.study import Collapse


def _load(*, quick: bool) -> Collapse:
    from studies.collapse.study import Collapse  # noqa: PLC0415  (pandas, matplotlib)

    return Collapse()


SHIPPED = Shipped(
    name="collapse",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"l_over_w": 0.4, "gamma": 2.5},
    about="""\
free-standing columns of U-shapes on a vibrating floor at Γ = 2 to 4: collapse times, and Δ of
τ = (1/f) exp(Δ/Γ) against l/w, compared with Gravish et al. (PRL 108, 208001). 192 runs, seed by seed;
columns that stand to the end give bounds. --quick takes minutes: lower and narrower columns.""",
)
