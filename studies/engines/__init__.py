"""The study `engines`: the same seeds on both engines, and YADE's chains of spheres ever finer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.engines.study import Engines


def _load(*, quick: bool) -> Engines:
    from studies.engines.study import Engines  # noqa: PLC0415  (pandas, matplotlib)

    return Engines()


SHIPPED = Shipped(
    name="engines",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"case": "external", "variant": "links"},
    about="""\
the same seeds on both engines, eight of them: φ_0, φ_f, ⟨N⟩, h/h0, energies, hook force, collapse time, force of a
chain; each difference with its 95 % confidence interval against a margin that was chosen beforehand: equivalent,
different or not resolved. And YADE's pitch 1.3, 1.0, 0.5, 0.25 → links. --quick: two procedures, minutes.""",
)
