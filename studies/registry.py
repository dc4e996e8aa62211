"""The shipped studies; a new one is a folder, and a line here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from dem.errors import InputError, nearest
from studies import (
    casting,
    chain,
    collapse,
    engines,
    finite_size,
    fracture,
    friction,
    gravish,
    landscape,
    melting,
    procedures,
    sensitivity,
    strength,
)
from studies.base.shipped import Shipped

STUDIES: Mapping[str, Shipped] = MappingProxyType(
    {
        study.name: study
        for study in (
            gravish.SHIPPED,
            friction.SHIPPED,
            friction.CONTACTS,
            friction.COMPACTION,
            sensitivity.SHIPPED,
            sensitivity.SECTION,
            procedures.SHIPPED,
            procedures.CODE,
            procedures.CODE_ON_YADE,
            procedures.FACTORS,
            fracture.SHIPPED,
            fracture.CODE,
            strength.SHIPPED,
            strength.CODE,
            landscape.SHIPPED,
            finite_size.SHIPPED,
            melting.SHIPPED,
            melting.CODE,
            casting.SHIPPED,
            casting.CODE,
            collapse.SHIPPED,
            chain.SHIPPED,
            chain.BODIES,
            engines.SHIPPED,
        )
    }
)
"""By name, in the order in which they are told."""


def shipped(name: str) -> Shipped:
    """A shipped study.

    Raises:
        InputError: There is none of this name.
    """
    if name not in STUDIES:
        msg = f"study {name!r} does not exist; {nearest(name, sorted(STUDIES))}"
        raise InputError(msg)
    return STUDIES[name]


def study_file(name: str, *, quick: bool = False) -> Path:
    """Sweep file of a study.

    Raises:
        InputError: There is no such study, or it has no quick variant.
    """
    return shipped(name).sweep_file(quick=quick)
