"""What the scene of a run asked for: its phases, container and hooks, from `scene.yaml`.

Read without the checks of `dem.scene`: a run directory tells what was run, also where this version would refuse such a
scene, and every default of the version that ran it is written out in the file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from dem.record.files import cannot_read
from dem.record.names import SCENE
from dem.scene.yaml_text import load_yaml

_REMEDY = "give the directory of a run made by this version of `smarticles run`"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """A part of the scene.

    Attributes:
        path: The scene file.
        place: Where in it, e.g. "phases.2."; empty for the scene itself.
        values: Everything that the scene says of it, defaults included.
    """

    path: Path
    place: str = ""
    values: Mapping[str, Any]

    def number(self, key: str, *, positive: bool = False) -> float:
        """A number.

        Args:
            key: Its key.
            positive: Whether it must be above 0.

        Raises:
            InputError: The scene does not say it, or it is no such number.
        """
        value = self.values.get(key)
        kind = "a finite number above 0" if positive else "a finite number"
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            cannot_read("scene", self.path, f"{self.place}{key} must be {kind}: got {value!r}", _REMEDY)
        if positive and value <= 0:
            cannot_read("scene", self.path, f"{self.place}{key} must be {kind}: got {value!r}", _REMEDY)
        return float(value)

    def part(self, key: str) -> Settings | None:
        """A part of this part; None where there is none, or null.

        Raises:
            InputError: It is something else than a mapping.
        """
        value = self.values.get(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            cannot_read("scene", self.path, f"{self.place}{key} must be a mapping: got {value!r}", _REMEDY)
        return Settings(path=self.path, place=f"{self.place}{key}.", values=MappingProxyType(value))

    def parts(self, key: str) -> tuple[Settings, ...]:
        """A list of parts; empty where there is none, or null.

        Raises:
            InputError: It is something else than a list of mappings.
        """
        value = self.values.get(key)
        if value is None:
            return ()
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            cannot_read("scene", self.path, f"{self.place}{key} must be a list of mappings: got {value!r}", _REMEDY)
        return tuple(
            Settings(path=self.path, place=f"{self.place}{key}.{index}.", values=MappingProxyType(item))
            for index, item in enumerate(value)
        )


@dataclass(frozen=True, kw_only=True)
class PhaseSettings(Settings):
    """One phase as the scene describes it.

    Attributes:
        index: Position in the run, as in `Frame.phase`.
        type: Name of the kind of phase.
    """

    index: int
    type: str


def read_scene(directory: Path | str) -> Settings:
    """The scene of a run.

    Args:
        directory: A run directory.

    Raises:
        InputError: The file is missing, damaged, or no mapping.

    Source:
        ARCHITECTURE.md, "The run directory": the resolved scene, every default written out.
    """
    path = Path(directory) / SCENE
    try:
        content = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        cannot_read("scene", path, error, _REMEDY)
    if not isinstance(content, dict):
        cannot_read("scene", path, "it must be a mapping", _REMEDY)
    return Settings(path=path, values=MappingProxyType(content))


def read_phases(directory: Path | str) -> tuple[PhaseSettings, ...]:
    """The phases of a run's scene.

    Args:
        directory: A run directory.

    Returns:
        The phases in order.

    Raises:
        InputError: As in `read_scene`, or the scene lists no phases.
    """
    scene = read_scene(directory)
    phases = scene.values.get("phases")
    if not isinstance(phases, list) or not all(isinstance(phase, dict) and "type" in phase for phase in phases):
        cannot_read("scene", scene.path, "'phases' must be a list of phases with a type", _REMEDY)
    return tuple(
        PhaseSettings(path=part.path, place=part.place, values=part.values, index=index, type=str(part.values["type"]))
        for index, part in enumerate(scene.parts("phases"))
    )
