"""Hooks in the pile and the phase that pulls one out, as data."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from dem.setting.part import Duration, Length, Part, refuse_wrong_unit

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from dem.setting.parts import Smarticle

Array = NDArray[np.float64]

TOLERANCE = 1e-9  # relative; lengths and times that meet their limit up to rounding are allowed


class Hooks(Part):
    """Two horizontal crosses on the axis, each of two square bars at right angles; in place before the pour.

    They rub and damp like the container, and move with it.
    """

    side_m: Length = Field(..., description="side of the bars' square section [m]; default: thickness_in_plane_m, t2")
    length_m: Length = Field(..., description="length of the bars [m]; default: middle_length_m, w")
    lower_height_m: Length = Field(
        ..., description="height of the lower cross's centre above the floor [m]; default: 10 t2"
    )
    upper_height_m: Length = Field(
        ..., description="height of the upper cross's centre above the floor at the start [m]; default: 20 t2"
    )

    _length_unit = field_validator("side_m", "length_m", "lower_height_m", "upper_height_m")(refuse_wrong_unit)

    @property
    def crosses(self) -> tuple[Cross, Cross]:
        """The lower and the upper cross."""
        lower, upper = (
            Cross(height=height, side=self.side_m, length=self.length_m)
            for height in (self.lower_height_m, self.upper_height_m)
        )
        return lower, upper


def _time_of_pull(data: dict[str, Any]) -> float:
    """Default of `PullHook.duration_s`: until the hook has arrived."""
    return float(data["distance_m"] / data["speed_m_per_s"])


class PullHook(Part):
    """Raise a hook at constant speed; its reaction force is the outcome. Motors hold: smarticles are welded."""

    type: Literal["pull-hook"]
    which: Literal["upper"] = Field("upper", description="the hook that is raised; the other one stays")
    distance_m: Length = Field(..., description="how far the hook is raised [m]; default: 2w")
    speed_m_per_s: float = Field(..., gt=0, description="speed of the hook [m/s]; default: w per second")
    duration_s: Duration = Field(
        default_factory=_time_of_pull,
        description="length of the phase [s]; default: until the hook has arrived; longer: it then stays where it is",
    )
    force_limit_N: float | None = Field(
        None,
        gt=0,
        description="force on the raised hook, mean over 0.01 s, at which it stops and the phase soon ends [N], as a "
        "testing machine does before it breaks; null: none. A rigid smarticle that holds both hooks takes any force",
    )

    _length_unit = field_validator("distance_m")(refuse_wrong_unit)

    @model_validator(mode="after")
    def _arrives(self) -> Self:
        needed = self.distance_m / self.speed_m_per_s
        if self.duration_s < needed * (1 - TOLERANCE):
            msg = (
                f"duration_s: {self.duration_s:g} s is too short to raise the hook by distance_m = "
                f"{self.distance_m:g} m at speed_m_per_s = {self.speed_m_per_s:g} m/s; use at least {needed:.6g} s"
            )
            raise ValueError(msg)
        return self


# Widths w and thicknesses t2 that the keys are by default.
_HOOK_DEFAULTS = {"side_m": (0, 1), "length_m": (1, 0), "lower_height_m": (0, 10), "upper_height_m": (0, 20)}
_PULL_DEFAULTS = {"distance_m": (2, 0), "speed_m_per_s": (1, 0)}


def with_hook_defaults(hooks: Any, smarticle: Smarticle) -> Any:
    """Data of `Hooks` with the keys filled in that follow from the smarticle; anything else is left to validation."""
    return _filled(hooks, _HOOK_DEFAULTS, smarticle)


def with_pull_defaults(phase: Any, smarticle: Smarticle) -> Any:
    """The same for data of a phase, which is left alone unless it pulls a hook."""
    pulls = isinstance(phase, Mapping) and phase.get("type") == "pull-hook"
    return _filled(phase, _PULL_DEFAULTS, smarticle) if pulls else phase


def _filled(data: Any, defaults: Mapping[str, tuple[int, int]], smarticle: Smarticle) -> Any:
    if not isinstance(data, Mapping):
        return data
    w, t2 = smarticle.middle_length_m, smarticle.thickness_in_plane_m
    return {key: a * w + b * t2 for key, (a, b) in defaults.items()} | dict(data)


@dataclass(frozen=True, kw_only=True)
class Cross:
    """One hook as the engine builds it. Lengths in m.

    Args:
        height: of the centre above the floor.
        side: of the bars' square section.
        length: of the bars, which lie along x and y.
    """

    height: float
    side: float
    length: float

    @property
    def half_extents(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Half edges of the two bars along x, y, z [m]."""
        long, thick = self.length / 2, self.side / 2
        return (long, thick, thick), (thick, long, thick)

    @property
    def reach(self) -> float:
        """Largest distance [m] of the bars from the axis: that of the corners at their ends."""
        return math.hypot(self.length, self.side) / 2

    def obstacles(self, diameter: float) -> Array:
        """(n, 3) points [m] such that a sphere of `diameter` [m] centred a diameter from all touches no bar."""
        # A grid through the bars. No point of a bar is farther than √3/2 of the spacing from the grid, which is less
        # than the radius that spheres keep away beyond their own.
        points: list[tuple[float, ...]] = []
        for extents in self.half_extents:
            axes = [np.linspace(-half, half, 1 + math.ceil(2 * half / (diameter / 2))) for half in extents]
            points += list(itertools.product(*axes))
        grid: Array = np.array(points) + np.array([0.0, 0.0, self.height])
        return grid


def check_hooks(scene: Scene) -> None:
    """Check the hooks against the container, each other and the phases.

    Raises:
        ValueError: one line with key, value and the way out.
    """
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, PullHook) and scene.hooks is None:
            msg = f"phases.{index}: pull-hook, but the scene has no hooks; add the key hooks (`hooks: {{}}` will do)"
            raise ValueError(msg)
    if scene.hooks is not None:
        _check_bars(scene.hooks)
        _check_room(scene, scene.hooks)


def _check_bars(hooks: Hooks) -> None:
    if hooks.side_m > hooks.length_m:
        msg = f"hooks.side_m: {hooks.side_m:g} m is more than length_m = {hooks.length_m:g} m; bars are long and thin"
        raise ValueError(msg)
    if hooks.lower_height_m < hooks.side_m / 2:
        msg = (
            f"hooks.lower_height_m: {hooks.lower_height_m:g} m puts bars of side_m = {hooks.side_m:g} m into the "
            f"floor; use at least {hooks.side_m / 2:g} m"
        )
        raise ValueError(msg)
    if hooks.upper_height_m < hooks.lower_height_m + hooks.side_m * (1 - TOLERANCE):
        least = hooks.lower_height_m + hooks.side_m
        msg = (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is not above the lower hook, whose top is at "
            f"{hooks.lower_height_m + hooks.side_m / 2:g} m; use at least {least:g} m"
        )
        raise ValueError(msg)


def _check_room(scene: Scene, hooks: Hooks) -> None:
    cylinder, top = scene.cylinder, hooks.upper_height_m + hooks.side_m / 2
    pulled = next((k for k, phase in enumerate(scene.phases) if isinstance(phase, PullHook)), None)
    highest = scene.ample_height()
    if pulled is not None and top - hooks.side_m > highest:
        msg = (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is above all that {scene.count} smarticles can reach "
            f"while they are poured, {highest:.3g} m, so that phases.{pulled} (pull-hook) would feel nothing; lower it"
        )
        raise ValueError(msg)
    if top > cylinder.height:
        msg = (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is outside the container, whose wall ends at "
            f"{cylinder.height:g} m; use at most {cylinder.height - hooks.side_m / 2:g} m"
        )
        raise ValueError(msg)
    # A tier is narrower than those below it: what fits into the highest one that a hook reaches fits into all.
    raised = sum(phase.distance_m for phase in scene.phases if isinstance(phase, PullHook))
    free = float(cylinder.inner_radii(np.array([top + raised]))[0])
    reach = hooks.crosses[1].reach
    if reach >= free:
        most = 2 * math.sqrt(max(0.0, free**2 - (hooks.side_m / 2) ** 2))
        msg = (
            f"hooks.length_m: {hooks.length_m:g} m is inside the wall, whose flats are {free:.4g} m from the axis; use "
            f"less than {most:.4g} m"
        )
        raise ValueError(msg)


def hook_warnings(scene: Scene) -> tuple[str, ...]:
    """Hooks that one smarticle can hold both of, where one is pulled with any force, as one line with the way out."""
    hooks = scene.hooks
    unlimited = [phase for phase in scene.phases if isinstance(phase, PullHook) and phase.force_limit_N is None]
    if hooks is None or not unlimited:
        return ()
    across = hooks.upper_height_m - hooks.lower_height_m + hooks.side_m
    inside = scene.smarticle.middle_length_m - scene.sphere_diameter
    if across >= inside:
        return ()
    return (
        f"hooks.upper_height_m: the hooks are {across:.3g} m from outside to outside, less than a smarticle's inner "
        f"length, {inside:.3g} m: one smarticle can hold both hooks, and then only the contacts give way; set them at "
        f"least {1.005 * (inside - hooks.side_m):.3g} m apart, or give pull-hook a force_limit_N",
    )
