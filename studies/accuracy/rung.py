"""The rungs of a ladder: values of knobs, and the scene itself among them."""

from __future__ import annotations

from dataclasses import dataclass

BASE = "base"
"""Setting of the scene as it stands, which the others are variants of."""

SENSITIVITIES = frozenset({"restitution"})
"""Knobs of what is modelled, not of how well; their rungs are compared with the scene itself."""

ACTUATED = frozenset({"actuate", "shape-change", "internal-oscillation"})
"""Types of phase in which barbs move."""

ACTIVITIES = ACTUATED | {"shake"}
"""Types of phase that do something to the pile in its container; packing is compared before and after them."""


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One value of one knob.

    Attributes:
        knob: Key of `ladder.KNOBS`.
        value: The value, as text.
        unit: Its unit, or empty.
        setting: Name of the variant of the scene that has it; runs are named SETTING_seedN.
    """

    knob: str
    value: str
    unit: str
    setting: str

    @property
    def label(self) -> str:
        """Value and unit."""
        return f"{self.value} {self.unit}".rstrip()

    @property
    def sensitivity(self) -> bool:
        """Whether the knob belongs to what is modelled, so that its rungs differ and do not err."""
        return self.knob in SENSITIVITIES
