"""Motors against loads: torques are read from YADE's bonds, not from the motors' own books."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import hinge_cases
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


@pytest.fixture
def data(scene_data: SceneData) -> SceneData:
    """Plain data of a scene whose smarticles have hinges."""
    phases = [{"type": "deposit"}, {"type": "shape-change"}]
    return lambda changes=None: scene_data({"phases": phases, **(changes or {})})


@pytest.mark.parametrize("freed", [True, False])
def test_blocked_motor_halts_holds_and_comes_free(simulate: Simulate, data: SceneData, freed: bool) -> None:
    # Told to straighten at 5 rad/s while all links are held; then freed, or told to go back by 0.003 rad.
    blocked = simulate(hinge_cases.blocked, data(), freed=freed, back=0.003)
    limit, mark = blocked["limit"], blocked["mark"]
    commands, torques, halted = (blocked[key][:mark] for key in ("commands", "torques", "halted"))
    # The torque of each look is that of YADE after the period that follows it.
    over = np.abs(torques) >= limit
    first = int(np.argmax(over.all(axis=1)))
    assert over[first].all()
    assert np.abs(torques[:first]).max() < limit
    # It stops within one period, and at no more than that period's advance above the limit.
    assert np.abs(torques).max() < limit + blocked["advance"]
    assert (commands[first:] == commands[first]).all()
    assert halted[first + 1 :].all()
    assert not halted[: first + 1].any()
    assert torques[first:] == pytest.approx(np.tile(torques[first], (mark - first, 1)), rel=1e-9)
    later = blocked["commands"][mark:]
    if freed:
        # Once free it goes all the way.
        assert later[-1] == pytest.approx(blocked["goal"], abs=1e-12)
        assert blocked["angles"] == pytest.approx(blocked["goal"], abs=0.02)
    else:
        # It gives way, although its torque stands against that at once: commands go up in the very first period.
        assert (later[0] > commands[-1]).all()
        assert later[-1] == pytest.approx(blocked["goal"], abs=1e-12)
        assert not blocked["halted"][mark:].any()
