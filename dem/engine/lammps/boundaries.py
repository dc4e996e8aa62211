"""Floor and wall on LAMMPS, whose heights are variables in LAMMPS and are also computed here."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dem.errors import RunError
from dem.setting.container import Cylinder


@dataclass
class Part:
    """Floor or wall, at a height of base + amplitude sin(ωt)."""

    base: float = 0.0  #: Height at rest [m]
    amplitude: float = 0.0  #: Amplitude of the shaking [m]


@dataclass
class LammpsBoundaries:
    """`dem.engine.interface.Boundaries` on LAMMPS."""

    cylinder: Cylinder
    send: Callable[[Iterator[str]], None]  #: Sends commands to LAMMPS
    clock: Callable[[], tuple[int, float]]  #: Returns the number of steps made, and the time step [s]
    walled: bool = True
    _omega: float = 0.0  # ω [rad/s]
    _begun: float = 0  # step at which the sine is at its middle, the first one of the shaking or a quarter later
    _parts: dict[str, Part] = field(default_factory=lambda: {"floor": Part(), "wall": Part()})

    upper_height = math.nan
    hook_sums = channel_sums = np.zeros((0, 3))
    plate_height, plate_sum = None, np.zeros(3)

    def _phase(self) -> float:
        steps, dt = self.clock()
        return self._omega * (steps - self._begun) * dt

    def _height(self, name: str) -> float:
        part = self._parts[name]
        return part.base + part.amplitude * math.sin(self._phase())

    @property
    def floor(self) -> float:
        return self._height("floor")

    @property
    def velocity(self) -> float:
        return self._parts["floor"].amplitude * self._omega * math.cos(self._phase())

    @property
    def moving(self) -> bool:
        """Whether floor or wall move."""
        return self._omega > 0 and any(part.amplitude for part in self._parts.values())

    @property
    def wall_bottom(self) -> float:
        return self._height("wall") + self.cylinder.bottom if self.walled else math.inf

    @property
    def wall_top(self) -> float:
        """Height of the wall's upper edge [m]."""
        return self._height("wall") + self.cylinder.height

    @property
    def enclosed(self) -> bool:
        return self.walled and self.wall_bottom < self.floor

    @property
    def raised(self) -> float | None:
        return 0.0 if self.enclosed else None

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True, from_rest: bool = False) -> None:
        self._hold()
        self._begun, self._omega = self.clock()[0], 2 * math.pi * frequency
        if from_rest:  # a quarter of a period later, and from the lowest point
            self._begun += 0.25 / (frequency * self.clock()[1])
        for name in ("floor", "wall") if walls and self.walled else ("floor",):
            self._parts[name].amplitude = amplitude
            self._parts[name].base += amplitude if from_rest else 0.0
        self.send(self.variables())

    def stop(self) -> None:
        self._hold()
        self.send(self.variables())

    def _hold(self) -> None:
        for name, part in self._parts.items():
            part.base, part.amplitude = self._height(name), 0.0
        self._omega = 0.0

    def stop_shaking(self) -> None:
        self.stop()

    def lift_wall(self, speed: float) -> None:
        raise RunError("engine: lammps cannot lift the wall")

    def raise_upper(self, speed: float) -> None:
        raise RunError("engine: lammps has no hooks")

    def place_plate(self, height: float) -> None:
        raise RunError("engine: lammps has no plates")

    def move_plate(self, speed: float) -> None:
        """Do nothing without a plate."""

    def remove_plate(self) -> None:
        """Do nothing without a plate."""

    def remove_wall(self) -> None:
        self.walled = False
        self.send(iter(("unfix wall", "region wall delete")))

    def variables(self) -> Iterator[str]:
        """Yield the commands that set the variables for the heights of floor and wall."""
        yield f"variable omega equal {self._omega:.17g}"
        yield f"variable begun equal {self._begun!r}"
        for name, part in self._parts.items():
            yield f"variable {name}_base equal {part.base:.17g}"
            yield f"variable {name}_amplitude equal {part.amplitude:.17g}"

    @property
    def memory(self) -> dict[str, Any]:
        parts = {name: [part.base, part.amplitude] for name, part in self._parts.items()}
        return {"walled": self.walled, "omega": self._omega, "begun": self._begun, "parts": parts}

    def restore(self, memory: Mapping[str, Any]) -> None:
        self.walled, self._omega, self._begun = memory["walled"], memory["omega"], memory["begun"]
        self._parts = {name: Part(*numbers) for name, numbers in memory["parts"].items()}
