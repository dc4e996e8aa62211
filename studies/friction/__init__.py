"""The study `friction`: which friction packs smarticles as Gravish et al. found, and is it that of steel?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.friction.study import Friction


def _load(*, quick: bool) -> Friction:
    from studies.friction.scatter import AT_THE_PAPERS  # noqa: PLC0415  (pandas)
    from studies.friction.study import Friction  # noqa: PLC0415  (pandas, matplotlib)

    # Fewer smarticles scatter more than those runs did.
    return Friction({} if quick else AT_THE_PAPERS)


SHIPPED = Shipped(
    name="friction",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"l_over_w": 0.7, "friction": 0.65},
    about="""\
U-shapes of three aspect ratios l/w, poured and shaken for Gravish's 20 s, at coefficients of friction μ from 0.2
to 0.8: which μ gives Gravish's packing fractions, whether one does at every l/w, and how steel compares.""",
)
