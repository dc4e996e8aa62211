"""How long phases take in simulated time, as far as that is known before the run."""

from __future__ import annotations

import math

from dem.phases.chain import Arrange
from dem.scene.scene import Scene
from dem.setting.parts import Deposit, Phase

LAYER_SECONDS = 0.1  # from a layer of a pour to the next, about
SETTLE_SECONDS = 0.2  # of a pile that was poured, about


def known_duration(phase: Phase) -> float | None:
    """Length of a phase [s]; None where a criterion ends it."""
    if isinstance(phase, Deposit):
        return None
    return 0.0 if isinstance(phase, Arrange) else phase.duration_s


def expected_duration(phase: Phase, count: int) -> float:
    """Length of a phase [s], estimated where a criterion ends it.

    Args:
        phase: the phase.
        count: smarticles in the scene.
    """
    if isinstance(phase, Deposit):
        return LAYER_SECONDS * math.ceil(count / phase.per_layer) + SETTLE_SECONDS
    return known_duration(phase) or 0.0


def run_duration(scene: Scene) -> tuple[float, bool]:
    """Length of a whole run [s], and whether that is known or in part estimated."""
    known = all(known_duration(phase) is not None for phase in scene.phases)
    return sum(expected_duration(phase, scene.count) for phase in scene.phases), known
