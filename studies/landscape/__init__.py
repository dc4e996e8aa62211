"""The study `landscape`: packing, entanglement, linking and strength over l/w, θ and the energy spent."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.landscape.study import Landscape


def _load(*, quick: bool) -> Landscape:
    from studies.landscape.study import Landscape  # noqa: PLC0415  (pandas, matplotlib)

    return Landscape()


SHIPPED = Shipped(
    name="landscape",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"procedure": "internal", "l_over_w": 0.7, "theta_deg": 10},
    about="""\
packing fraction, entanglement, linking number and strength of piles over l/w, the amplitude θ of the internal
oscillation and the energy that it spends, by the rules of the paper's code: 204 points for each of three seeds. Which
measure goes with strength best, and which procedure buys it cheapest; --quick takes minutes.""",
)
