"""The studies `friction` and `compaction`: which friction packs smarticles as Gravish et al. found, how φ goes on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.friction.compaction import Compaction
    from studies.friction.study import Friction


def _load(*, quick: bool) -> Friction:
    from studies.friction.scatter import AT_THE_PAPERS  # noqa: PLC0415  (pandas)
    from studies.friction.study import Friction  # noqa: PLC0415  (pandas, matplotlib)

    # Fewer smarticles scatter more than those runs did.
    return Friction({} if quick else AT_THE_PAPERS)


def _load_compaction(*, quick: bool) -> Compaction:
    from studies.friction.compaction import Compaction  # noqa: PLC0415  (pandas, matplotlib, scipy)

    return Compaction()


SHIPPED = Shipped(
    name="friction",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"l_over_w": 0.7, "friction": 0.65},
    about="""\
U-shapes of three aspect ratios l/w, poured and shaken for Gravish's 20 s, at coefficients of friction μ from 0.2
to 0.8: which μ gives Gravish's packing fractions, whether one does at every l/w, and how steel compares.""",
)

COMPACTION = Shipped(
    name="compaction",
    folder=Path(__file__).parent,
    load=_load_compaction,
    pictured={"friction": 0.4},
    about="""\
U-shapes of l/w = 0.7 shaken for 200 s, ten times as long as Gravish's, at two coefficients of friction: whether φ
still grows, and by which law. 16 runs of about five minutes each.""",
)
