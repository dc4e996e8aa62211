"""Tests of known answers and orders of convergence on both engines."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import linregress

from dem.physics.contact import damping_ratio, restitution_of
from validation.access import engine_access
from validation.cases import CASES, LADDERS, Answer
from validation.conftest import ON, Tables
from validation.known import chung, floor, free, granular, hinge, impact, kept, statics
from validation.known.balls import EQUAL_PHASE, Hertz, Material, mindlin_impacts
from validation.known.theory import bounced, dashpot_impact, falling_on_springs, free_rotation

assert all((free, granular, kept, statics))  # imported to register their cases

Call = Callable[..., Any]

BAND = 0.3  # largest deviation of an observed order [1]; rejects 1.5, halfway between first and second order


def failed(answers: list[Answer]) -> list[Answer]:
    """Return the answers outside of their tolerance; AssertionError if there are no answers."""
    assert answers
    return [answer for answer in answers if not answer.good]


def quantity_and_unit(what: str) -> dict[str, str]:
    """Split `quantity [unit]` into two columns of a table."""
    name, _, unit = what.rpartition(" [")
    return {"quantity": name, "unit": unit.removesuffix("]")}


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize(("name", "run", "about", "theory", "absent"), CASES)
def test_known_answer(
    call: Call, tables: Tables, *, name: str, run: Call, about: str, theory: str, absent: dict[str, str], engine: str
) -> None:
    if engine in absent:
        pytest.skip(f"not applicable: {absent[engine]}")
    answers = call(engine, run, engine_access(engine))
    rows = [
        {
            "case": name,
            "engine": engine,
            **quantity_and_unit(one.what),
            "theory [unit]": one.theory,
            "measured [unit]": one.measured,
            "error [1]": one.error,
            "tolerance [1]": one.tolerance,
            "ok": one.good,
            "error relative to [unit]": one.scale or abs(one.theory),
            "about": about,
            "source": theory,
            "reason of the tolerance": one.reason,
        }
        for one in answers
    ]
    tables.write(engine, "verification", rows, ["case"])
    assert failed(answers) == []


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("size", ["short", pytest.param("long", marks=pytest.mark.long)])
@pytest.mark.parametrize(("name", "errors_at", "about", "quantity", "motion", "steps", "scheme", "phases"), LADDERS)
def test_order_is_the_schemes(
    call: Call,
    tables: Tables,
    *,
    name: str,
    errors_at: Call,
    about: str,
    quantity: str,
    motion: float,
    steps: tuple[float, ...],
    scheme: dict[str, tuple[int, str]],
    phases: int | None,
    size: str,
    engine: str,
) -> None:
    order, why = scheme[engine]
    if size == "short":
        steps = steps[1::2]  # two steps with a ratio of 4
    options = {"phases": phases} if size == "short" and phases else {}
    errors = call(engine, errors_at, engine_access(engine), steps, **options)
    observed = float(linregress(np.log(steps), np.log(np.abs(errors))).slope)
    if size == "long":
        parts = quantity_and_unit(quantity)
        keys = {"ladder": name, "engine": engine, "quantity": parts["quantity"]}
        rows = [
            {**keys, "unit": parts["unit"], "time step [s]": step, "error [unit]": error}
            for step, error in zip(steps, errors, strict=True)
        ]
        tables.write(engine, "trajectories", rows, ["ladder"])
        row = {**keys, "order of the scheme [1]": order, "order observed [1]": observed, "tolerance [1]": BAND}
        tables.write(engine, "orders", [{**row, "about": about, "why": why}], ["ladder"])
    assert observed == pytest.approx(order, abs=BAND)
    assert max(errors) < 0.1 * motion or size == "long"  # the time step resolves the motion


@pytest.mark.long
@pytest.mark.parametrize("engine", ON)
def test_flat_impacts_over_the_number_of_points(call: Call, tables: Tables, engine: str) -> None:
    rows = [{"engine": engine, **row} for row in call(engine, floor.flat_impacts, engine_access(engine))]
    tables.write(engine, "clumps", rows, ["engine"])
    # The restitution of n parallel contacts differs from the nominal one of a single contact.
    assert [row["measured"] for row in rows] == pytest.approx([row["theory"] for row in rows], abs=0.02)


BOTH, YADE = ("yade", "links"), ("yade",)
OTHER: list[tuple[Call, dict[str, Any], tuple[str, ...]]] = [
    *((run, {"restitution": e}, BOTH) for run in (impact.bar_rebound, impact.bars_rebound) for e in (0.2, 0.9)),
    *((impact.bar_rebound, {"restitution": e, "resized": True}, BOTH) for e in (0.05, 0.2, 0.8)),
    *((floor.slide, {"aspect_ratio": aspect, "friction": mu}, BOTH) for aspect, mu in ((0.7, 0.2), (0.3, 0.4))),
    *(
        (hinge.droop, {"aspect_ratio": aspect, "fidelity": name}, BOTH)
        for name in ("draft", "standard")
        for aspect in (0.4, 1.0)
    ),
    *((hinge.pendulum, {"aspect_ratio": aspect}, BOTH) for aspect in (0.4, 1.0)),
    *(
        (hinge.pull, {"aspect_ratio": aspect, "fidelity": name, "largest": largest}, YADE)
        for name, largest in (("standard", 0.01), ("draft", 0.03))
        for aspect in (0.4, 0.7, 1.0)
    ),
    (hinge.tilt, {"sweeps": 3}, YADE),
]  #: Cases with other parameters: function, options, engines


@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize(("run", "options", "engines"), OTHER, ids=[f"{run.__name__}-{keys}" for run, keys, _ in OTHER])
def test_other_parameters(
    call: Call, run: Call, options: dict[str, Any], engines: tuple[str, ...], engine: str
) -> None:
    if engine not in engines:
        pytest.skip("not applicable")
    assert failed(call(engine, run, engine_access(engine), **options)) == []


# -- the theory itself, without an engine ------------------------------------------------------------------------------


@pytest.mark.parametrize(("measured", "ok"), [(1.009, True), (1.011, False), (0.0, False), (math.nan, False)])
def test_answer_passes_within_its_tolerance_only(measured: float, ok: bool) -> None:
    assert Answer("q [m]", 1.0, measured, 0.01).good is ok


def test_error_is_relative_to_the_scale_where_theory_is_zero() -> None:
    assert Answer("q [m]", 0.0, 0.02, 0.01, scale=2.0).error == 0.01


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9, 1.0])
def test_integrated_impact_is_schwagers_and_poeschels(restitution: float) -> None:
    zeta = damping_ratio(restitution)
    impact = dashpot_impact(stiffness=500.0, damping=2 * zeta * math.sqrt(500.0 * 2e-4), mass=2e-4)
    assert impact.restitution == pytest.approx(restitution_of(zeta), rel=1e-6)
    if restitution == 1:
        assert impact.duration == pytest.approx(math.pi * math.sqrt(2e-4 / 500), rel=1e-6)


def test_bounce_keeps_energy_where_nothing_damps() -> None:
    way = {"gap": 1e-4, "speed": 0.2, "stiffness": 500.0, "damping": 0.0, "mass": 2.6e-4, "gravity": 9.81}
    top = 1e-4 + 0.2**2 / (2 * 9.81)
    heights = [bounced(time=time, **way) for time in np.linspace(0.02, 0.03, 400)]
    assert max(heights) == pytest.approx(top, rel=1e-5)


def test_free_rotation_about_a_principal_axis_is_uniform() -> None:
    inertia, spin, times = np.array([1.0, 2.0, 3.0]), np.array([0, 0, 2.0]), np.array([0.5, 1.0])
    rotations, spins = free_rotation(inertia=inertia, start=Rotation.identity(), spin=spin, times=times)
    assert rotations.as_rotvec() == pytest.approx(np.array([[0, 0, 1.0], [0, 0, 2.0]]), abs=1e-9)
    assert spins == pytest.approx(np.tile([0, 0, 2.0], (2, 1)))


def test_springs_about_the_centre_are_one_spring_of_their_sum() -> None:
    points, inertia = np.array([[1e-3, 0], [-1e-3, 0], [0, 2e-3], [0, -2e-3]]), np.array([1e-10, 1e-10])
    after, lasts = falling_on_springs(points, stiffness=100.0, damping=0.02, mass=1e-4, inertia=inertia, speed=0.1)
    one = dashpot_impact(stiffness=400.0, damping=0.08, mass=1e-4)
    assert after == pytest.approx([0.1 * one.restitution, 0, 0], rel=2e-3, abs=1e-9)
    assert lasts == pytest.approx(one.duration, rel=0.01)


@pytest.mark.parametrize("material", [chung.STEEL, chung.POLYETHYLENE], ids=lambda material: material.name)
def test_published_curves_of_test_5_are_those_of_half_of_mindlins_stiffness(material: Material) -> None:
    def off(share: float) -> float:
        found = []
        for name in ("recoil", "spin after"):
            x, y = chung.curve(5, name, material.name).T
            after, spun = mindlin_impacts(0.3 * x, friction=0.3, ratio=share * material.mindlin)
            here = (after + spun if name == "recoil" else spun) / 0.3
            found.append(float(np.abs(here - y).max() / np.ptp(y)))
        return max(found)

    assert off(chung.HALF) < 0.02
    assert off(1.0) > 0.15


def test_equal_phases_of_tangential_vibrations() -> None:
    # Without slip, ∫ω dt over Hertz's contact, from the energy, is that of linear springs 6/5 times as stiff.
    hertz = Hertz(modulus=0.75, radius=1.0, mass=1.0, speed=1.0)
    place = np.sin(np.linspace(0, math.pi / 2, 200001)) ** 0.8  # overlap over the largest, even where it turns
    middle = (place[1:] + place[:-1]) / 2
    speed = np.sqrt(1 - middle**2.5)
    phase = 2 * float((np.sqrt(1.5 * np.sqrt(middle * hertz.deepest)) * np.diff(place) / speed).sum()) * hertz.deepest
    assert phase == pytest.approx(math.pi * math.sqrt(EQUAL_PHASE), rel=1e-3)
    assert hertz.duration == pytest.approx(2 * float((np.diff(place) / speed).sum()) * hertz.deepest, rel=1e-3)
