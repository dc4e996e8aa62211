"""The studies `friction`, `contacts` and `compaction`: Gravish's packing by what a contact is, and for how long."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studies.base.shipped import Shipped

if TYPE_CHECKING:
    from studies.friction.compaction import Compaction
    from studies.friction.contacts import Contacts
    from studies.friction.study import Friction


def _load(*, quick: bool) -> Friction:
    from studies.friction.study import Friction  # noqa: PLC0415  (pandas, matplotlib)

    return Friction()


def _load_compaction(*, quick: bool) -> Compaction:
    from studies.friction.compaction import Compaction  # noqa: PLC0415  (pandas, matplotlib, scipy)

    return Compaction()


def _load_contacts(*, quick: bool) -> Contacts:
    from studies.friction.contacts import Contacts  # noqa: PLC0415  (pandas, matplotlib)

    return Contacts()


SHIPPED = Shipped(
    name="friction",
    folder=Path(__file__).parent,
    load=_load,
    pictured={"l_over_w": 0.7, "friction": 0.65},
    about="""\
U-shapes of three aspect ratios l/w, poured and shaken for Gravish's 20 s, at coefficients of friction μ from 0.2
to 0.8: which μ gives Gravish's packing fractions, whether one does at every l/w, and how steel compares.""",
)

CONTACTS = Shipped(
    name="contacts",
    folder=Path(__file__).parent,
    load=_load_contacts,
    pictured={"l_over_w": 0.7, "friction": 0.8, "friction_wall": 0.4, "restitution": 0.7},
    about="""\
the same with friction between smarticles, friction at the container and restitution apart: all combinations of two
values of each at three l/w, what each does to φ, and whether one packs as Gravish found; 192 runs.""",
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
