"""What the scene of a run asked of its phases and its container, from `scene.yaml`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml

from postprocess.errors import refuse
from postprocess.region import Cylinder

_REMEDY = "give the directory of a run made by this version of `smarticles run`"


@dataclass(frozen=True, kw_only=True)
class PhaseSettings:
    """One phase as the scene describes it.

    Attributes:
        path: The scene file.
        index: Position in the run, as in `Frame.phase`.
        type: Name of the kind of phase.
        values: Everything that the scene says of it, defaults included.
    """

    path: Path
    index: int
    type: str
    values: Mapping[str, Any]

    def number(self, key: str) -> float:
        """A number.

        Raises:
            InputError: The scene does not say it, or it is no finite number.
        """
        value = self.values.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            refuse("scene", self.path, f"phases.{self.index}.{key} must be a finite number: got {value!r}", _REMEDY)
        return float(value)


def read_phases(directory: Path | str) -> tuple[PhaseSettings, ...]:
    """The phases of a run's scene.

    Args:
        directory: A run directory.

    Returns:
        The phases in order.

    Raises:
        InputError: The file is missing, damaged, or lists no phases.

    Source:
        ARCHITECTURE.md, "The run directory": the resolved scene, every default written out.
    """
    path, content = _read(directory)
    phases = content.get("phases")
    if not isinstance(phases, list) or not all(isinstance(phase, dict) and "type" in phase for phase in phases):
        refuse("scene", path, "'phases' must be a list of phases with a type", _REMEDY)
    return tuple(
        PhaseSettings(path=path, index=index, type=str(phase["type"]), values=MappingProxyType(phase))
        for index, phase in enumerate(phases)
    )


def read_tiers(directory: Path | str) -> tuple[Cylinder, ...]:
    """The tiers of a run's container, heights above its floor.

    Args:
        directory: A run directory.

    Returns:
        The tiers from below; none where the container is one cylinder.

    Raises:
        InputError: The file is missing or damaged, or a tier lacks its sizes.
    """
    path, content = _read(directory)
    container = content.get("container")
    tiers = container.get("tiers") if isinstance(container, dict) else None
    found, bottom = [], 0.0
    for number, tier in enumerate(tiers or ()):
        sizes = [tier.get(key) if isinstance(tier, dict) else None for key in ("radius_m", "height_m")]
        if not all(isinstance(size, int | float) and math.isfinite(size) and size > 0 for size in sizes):
            refuse(
                "scene", path, f"container.tiers.{number} must have radius_m and height_m > 0: got {tier!r}", _REMEDY
            )
        radius, height = np.array(sizes, dtype=np.float64).tolist()
        found.append(Cylinder(radius=radius, bottom=bottom, top=bottom + height))
        bottom += height
    return tuple(found)


def _read(directory: Path | str) -> tuple[Path, Mapping[str, Any]]:
    """The scene of a run, and the file that it comes from."""
    path = Path(directory) / "scene.yaml"
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        refuse("scene", path, error, _REMEDY)
    return path, content if isinstance(content, dict) else {}
