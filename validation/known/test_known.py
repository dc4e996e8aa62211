"""Known answers and convergence orders on each engine that can compute them; theory stands beside each case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.stats import linregress

from validation.case import CASES, LADDERS, Case, Ladder
from validation.check import Answer
from validation.conftest import Tables
from validation.engines import engine_access
from validation.known import bouncing, clumps, floor, free, hinge, impact, kept

assert all((bouncing, free, kept))  # imported to register their cases

Call = Callable[..., Any]

ON = [pytest.param("yade", marks=pytest.mark.engine), "links"]
BAND = 0.3  # an observed order is within this of the scheme's [1]: no order between first and second passes


def failed(answers: list[Answer]) -> list[Answer]:
    """Return the answers that fail; there must be answers."""
    assert answers
    return [answer for answer in answers if not answer.good]


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_known_answer(call: Call, tables: Tables, case: Case, engine: str) -> None:
    if reason := case.absent.get(engine):
        pytest.skip(f"not applicable: {reason}")
    answers = call(engine, case.run, engine_access(engine))
    rows = [
        {
            "case": case.name,
            "engine": engine,
            "quantity": one.quantity,
            "unit": one.unit,
            "theory [unit]": one.theory,
            "measured [unit]": one.measured,
            "error [1]": one.error,
            "tolerance [1]": one.tolerance,
            "ok": one.good,
            "error relative to [unit]": one.scale or abs(one.theory),
            "about": case.about,
            "source": case.theory,
            "reason of the tolerance": one.reason,
        }
        for one in answers
    ]
    tables.write(engine, "verification", rows, ["case"])
    assert failed(answers) == []


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("size", ["short", pytest.param("long", marks=pytest.mark.long)])
@pytest.mark.parametrize("ladder", LADDERS.values(), ids=LADDERS)
def test_order_is_the_schemes(call: Call, tables: Tables, ladder: Ladder, size: str, engine: str) -> None:
    order, why = ladder.scheme[engine]
    # Short: the second and the last step, a factor of four apart.
    steps = ladder.steps[1::2] if size == "short" else ladder.steps
    options = {"phases": ladder.phases} if size == "short" and ladder.phases else {}
    errors = call(engine, ladder.errors, engine_access(engine), steps, **options)
    observed = float(linregress(np.log(steps), np.log(np.abs(errors))).slope)
    if size == "long":
        same = {"ladder": ladder.name, "engine": engine, "quantity": ladder.quantity}
        rows = [
            {**same, "unit": ladder.unit, "time step [s]": step, "error [unit]": error}
            for step, error in zip(steps, errors, strict=True)
        ]
        tables.write(engine, "trajectories", rows, ["ladder"])
        row = {**same, "order of the scheme [1]": order, "order observed [1]": observed, "tolerance [1]": BAND}
        tables.write(engine, "orders", [{**row, "about": ladder.about, "why": why}], ["ladder"])
    assert observed == pytest.approx(order, abs=BAND)
    assert max(errors) < 0.1 * ladder.size or size == "long"  # the motion itself is resolved


@pytest.mark.long
@pytest.mark.parametrize("engine", ON)
def test_flat_impacts_over_the_number_of_points(call: Call, tables: Tables, engine: str) -> None:
    impacts = call(engine, clumps.flat_impacts, engine_access(engine))
    rows = [{"engine": engine, **asdict(one)} for one in impacts]
    tables.write(engine, "clumps", rows, ["engine"])
    # n springs and dashpots side by side: the measured restitution is the integrated one, not the one asked for.
    assert [row["measured"] for row in rows] == pytest.approx([row["theory"] for row in rows], abs=0.02)


# Other parameters of the same cases: name, function, options, engines.
OTHER = [
    *(
        (f"{run.__name__}, e = {e:g}", partial(run, restitution=e), "both")
        for run in (impact.bar_rebound, impact.bars_rebound)
        for e in (0.2, 0.9)
    ),
    *(
        (f"typical mass, e = {e:g}", partial(impact.bar_rebound, restitution=e, resized=True), "both")
        for e in (0.05, 0.2, 0.8)
    ),
    *(
        (f"slide, l/w = {aspect:g}, mu = {mu:g}", partial(floor.slide, aspect_ratio=aspect, friction=mu), "both")
        for aspect, mu in ((0.7, 0.2), (0.3, 0.4))
    ),
    *(
        (
            f"hinge pulled, {name}, l/w = {aspect:g}",
            partial(hinge.pull, aspect_ratio=aspect, fidelity=name, largest=most),
            "yade",
        )
        for name, most in (("standard", 0.01), ("draft", 0.03))
        for aspect in (0.4, 0.7, 1.0)
    ),
    *(
        (f"barb droops, {name}, l/w = {aspect:g}", partial(hinge.droop, aspect_ratio=aspect, fidelity=name), "both")
        for name in ("draft", "standard")
        for aspect in (0.4, 1.0)
    ),
    ("barb out of plane after three sweeps", partial(hinge.tilt, sweeps=3), "yade"),
    *((f"pendulum, l/w = {aspect:g}", partial(hinge.pendulum, aspect_ratio=aspect), "both") for aspect in (0.4, 1.0)),
]


@pytest.mark.parametrize(
    ("run", "engine"),
    [
        pytest.param(run, engine, id=f"{name}-{engine}", marks=pytest.mark.engine if engine == "yade" else ())
        for name, run, engines in OTHER
        for engine in (("yade",) if engines == "yade" else ("yade", "links"))
    ],
)
def test_other_parameters(call: Call, run: Callable[..., Any], engine: str) -> None:
    assert failed(call(engine, run, engine_access(engine))) == []
