"""What tests of the engine lammps are given: see `conftest.py`."""

from __future__ import annotations

from collections.abc import Callable

from dem.engine.lammps.engine import LammpsEngine

Build = Callable[..., LammpsEngine]
"""Builds the engine of a scene; `ranks` and what else differs by keyword."""
