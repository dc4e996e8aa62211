"""Known answers in the engine: the cases and ladders of `smarticles verify`, and other parameters of the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from postprocess.statistics.convergence import observed_order
from smarticles.verification.case import Case, Ladder
from smarticles.verification.check import Answer
from smarticles.verification.hands.kinds import hands_on
from smarticles.verification.known import floor, hinge, impact
from smarticles.verification.known.cases import CASES, LADDERS
from smarticles.verification.report import BAND

Simulate = Callable[..., Any]


def told(checks: list[Answer]) -> list[Answer]:
    """The checks that fail; all of them have been made."""
    assert checks
    return [check for check in checks if not check.good]


# Links need no YADE.
ON = [pytest.param("yade", marks=pytest.mark.engine), "links"]


@pytest.fixture
def on(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """Do something with the hands of an engine: those of YADE where it is, those of links here."""

    def do(engine: str, run: Simulate, *arguments: Any, **options: Any) -> Any:
        if engine == "links":
            return run(hands_on(engine), *arguments, **options)
        return request.getfixturevalue("simulate")(run, hands_on(engine), *arguments, **options)

    return do


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_known_answer(on: Simulate, case: Case, engine: str) -> None:
    if engine in case.absent:
        pytest.skip(f"not applicable: {case.absent[engine]}")
    assert told(on(engine, case.run)) == []


# The second and the last step of each ladder, a factor of four apart, and fewer places of the onset within a step.
SHORT = {
    "bounce, e = 0.5": {"phases": 16},
    "bounce, elastic": {"phases": 16},
    "collision, law of the scene": {"phases": 8},
    "collision, elastic and smooth": {"phases": 8},
    "sliding to rolling": {"phases": 2},
}


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("ladder", LADDERS, ids=lambda ladder: ladder.name)
def test_order_is_the_schemes(on: Simulate, ladder: Ladder, engine: str) -> None:
    steps = ladder.steps[1::2]
    errors = on(engine, ladder.errors, steps, **SHORT.get(ladder.name, {}))
    fit = observed_order(steps, errors, exact=0.0)
    assert fit.order == pytest.approx(ladder.scheme[engine][0], abs=BAND)
    assert errors[0] < 0.1 * ladder.size  # the motion itself is resolved


# -- other parameters --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("asked", [0.2, 0.9])
@pytest.mark.parametrize("bars", [impact.bar_rebound, impact.bars_rebound])
def test_rebound_of_bars(on: Simulate, bars: Simulate, asked: float, engine: str) -> None:
    assert told(on(engine, bars, restitution=asked)) == []


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("asked", [0.05, 0.2, 0.8])
def test_rebound_of_the_typical_mass_is_the_one_asked_for(on: Simulate, asked: float, engine: str) -> None:
    assert told(on(engine, impact.bar_rebound, restitution=asked, resized=True)) == []


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize(("aspect_ratio", "friction"), [(0.7, 0.2), (0.3, 0.4)])
def test_sliding_stops_by_coulombs_law(on: Simulate, aspect_ratio: float, friction: float, engine: str) -> None:
    assert told(on(engine, floor.slide, aspect_ratio=aspect_ratio, friction=friction)) == []


@pytest.mark.engine
@pytest.mark.parametrize("aspect_ratio", [0.4, 0.7, 1.0])
@pytest.mark.parametrize(("fidelity", "largest"), [("standard", 0.01), ("draft", 0.03)])
def test_pull_of_a_hundred_weights_opens_a_hinge_by_a_hundredth(
    simulate: Simulate, fidelity: str, largest: float, aspect_ratio: float
) -> None:
    assert (
        told(simulate(hinge.pull, hands_on("yade"), aspect_ratio=aspect_ratio, fidelity=fidelity, largest=largest))
        == []
    )


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("fidelity", ["draft", "standard"])
@pytest.mark.parametrize("aspect_ratio", [0.4, 1.0])
def test_horizontal_barb_hangs_on_its_motor(on: Simulate, fidelity: str, aspect_ratio: float, engine: str) -> None:
    assert told(on(engine, hinge.droop, aspect_ratio=aspect_ratio, fidelity=fidelity)) == []


@pytest.mark.engine
def test_barb_that_turned_far_hangs_out_of_plane_as_one_that_did_not(simulate: Simulate) -> None:
    assert told(simulate(hinge.tilt, hands_on("yade"), sweeps=3)) == []


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("aspect_ratio", [0.4, 1.0])
def test_free_barb_swings_as_a_physical_pendulum(on: Simulate, aspect_ratio: float, engine: str) -> None:
    assert told(on(engine, hinge.pendulum, aspect_ratio=aspect_ratio)) == []
