"""The study `gravish`: packing fraction before and after shaking, against Gravish et al. 2012."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.gravish.study import Gravish


def _load(*, quick: bool) -> Gravish:
    from postprocess.measures.packing import DEFINITIONS  # noqa: PLC0415
    from studies.framework.shaken import QUICK_DEFINITIONS  # noqa: PLC0415
    from studies.gravish.study import Gravish  # noqa: PLC0415  (pandas, matplotlib)

    return Gravish(QUICK_DEFINITIONS if quick else tuple(DEFINITIONS))


SHIPPED = Shipped(
    name="gravish",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"l_over_w": 0.7},
    about="""\
U-shapes of several aspect ratios l/w, poured into a cylinder and shaken at Γ = 2, 30 Hz, against the packing
fractions that Gravish et al. measured (PRL 108, 208001). --quick takes minutes and prints how it differs
from the full study, which takes hours.""",
)
