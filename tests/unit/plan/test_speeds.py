"""Walls, hooks and strings move by a small part of a sphere in a step, or the scene is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from test_chain_scene import chain

from dem.errors import InputError
from dem.plan.steps import MOST_PER_STEP, time_step, time_steps
from dem.scene.scene import Scene

MakeScene = Callable[..., Scene]
DEPOSIT = {"type": "deposit"}


def refusal(scene: Scene) -> str:
    with pytest.raises(InputError) as caught:
        time_steps(scene)
    return str(caught.value)


def fastest(scene: Scene) -> float:
    return MOST_PER_STEP * scene.sphere_diameter / time_step(scene)


@pytest.mark.parametrize("kind", ["remove-container", "pull-hook"])
def test_what_is_lifted_or_pulled_too_fast_is_refused(make_scene: MakeScene, kind: str) -> None:
    def moved_at(speed: float, fidelity: Any = "draft") -> Scene:
        phases = [DEPOSIT, {"type": kind, "speed_m_per_s": speed, "duration_s": 3.0}]
        return make_scene({"hooks": {}, "phases": phases, "fidelity": fidelity})

    most = fastest(moved_at(0.01))
    assert 0.3 < most < 1
    time_steps(moved_at(0.999 * most))
    told = refusal(moved_at(10.0))
    assert re.fullmatch(
        rf"phases\.1\.speed_m_per_s: 10 m/s \({kind}\) is 0\.\d+ sphere diameters in a time step of \S+ s, which "
        r"contacts cannot follow; use at most (\S+) m/s or a shorter fidelity\.time_step_s",
        told,
    )
    offered = re.search(r"at most (\S+) m/s", told)
    assert offered is not None
    time_steps(moved_at(float(offered[1])))
    assert float(offered[1]) == pytest.approx(most, rel=0.01)
    # The other way out.
    step = 0.9 * time_step(moved_at(0.01)) * most / 10
    time_steps(moved_at(10.0, {"base": "draft", "time_step_s": step}))


def test_a_chain_is_strained_by_the_same_rule() -> None:
    most = fastest(chain())
    assert most > 1  # spheres are large
    time_steps(chain(phases__1__speed_m_per_s=0.999 * most))
    told = refusal(chain(phases__1__speed_m_per_s=2 * most))
    assert told.startswith("phases.1.speed_m_per_s: ")
    assert "(strain) is 0.1 sphere diameters in a time step" in told
