"""Each reason for which the watchdog stops a run, with its literal text; and a healthy state that passes."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import make_boxes, small

from dem.body.state import State
from dem.errors import RunError
from dem.physics.overlaps import Extremes, Held, Overlaps
from dem.run.build import SPEED_MARGIN, build_watchdog
from dem.run.watchdog import Watchdog
from dem.setting.container import Cylinder

BOXES = make_boxes()
WATCHDOG = Watchdog(cylinder=Cylinder(radius=0.0234, height=0.1, facets=64), speed=5.0)


def healthy() -> State:
    positions = np.array([[0.0, 0.0, 0.01], [0.02, 0.0, 0.02], [0.0, -0.023, 0.099], [0.0, 0.0, 0.001]])
    velocities = np.array([[0.0, 0.0, -4.9], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    return State.rigid(BOXES, positions, np.tile(np.eye(3), (4, 1, 1)), velocities, np.zeros((4, 3)))


def check(state: State, floor: float = 0.0) -> None:
    WATCHDOG.check(state, floor=floor, time=1.25)


def test_healthy_states_pass() -> None:
    check(healthy())
    none = np.empty((0, 3))
    check(State.rigid(BOXES, none, np.empty((0, 3, 3)), none, none))  # nothing poured yet
    lifted = healthy()
    lifted.positions[:, 2] += 5.0
    check(lifted, floor=5.0)  # heights are above the floor, wherever it is


NO_NUMBER = "a position or velocity that is no number; lower fidelity.time_step_fraction"
LEFT = "left through the wall or the floor; raise fidelity.stiffness_N_per_m"


@pytest.mark.parametrize(
    ("values", "place", "value", "text"),
    [
        ("positions", (1, 0), math.nan, NO_NUMBER),
        ("link_velocities", (1, 2, 2), math.inf, NO_NUMBER),
        (
            *("link_velocities", (1, 2), [0.0, 3.0, -4.1]),  # a barb, not the whole
            "a speed above 5 m/s (fastest 5.08 m/s), which nothing in this scene explains; "
            "lower fidelity.time_step_fraction",
        ),
        ("positions", (1, slice(2)), [0.02, 0.02], LEFT),
        ("positions", (1, 2), -1e-6, LEFT),
        (
            *("positions", (1, 2), 0.101),
            "thrown out over the wall of 0.1 m; raise container.height_m, or shake or throw less",
        ),
    ],
)
def test_each_cause_stops_the_run(values: str, place: Any, value: Any, text: str) -> None:
    state = healthy()
    getattr(state, values)[place] = value
    with pytest.raises(RunError) as caught:
        check(state)
    assert str(caught.value) == f"at t = 1.2500 s: 1 smarticle(s) (1): {text}"


def test_what_leans_over_the_upper_edge_of_the_wall_is_thrown_out() -> None:
    points = np.tile([0.0, 0.0, 0.05], (4, 3, 1))
    points[1] = [[0.02, 0, 0.09], [0.025, 0, 0.098], [0.028, 0, 0.106]]
    for top, text in ((0.106, "thrown out over the wall of 0.1 m"), (0.0999, "left through the wall")):
        points[1, 2, 2] = top
        with pytest.raises(RunError, match=text):
            WATCHDOG.check(healthy(), floor=0.0, time=1.25, points=points)


def test_broken_hinge_is_named_with_its_gap() -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, gap=2e-4)
    gaps = np.full((4, 2), 1e-6)
    dog.check(healthy(), floor=0.0, time=1.25, gaps=gaps)
    dog.check(healthy(), floor=0.0, time=1.25, gaps=None)  # welded
    for bad in (3e-4, math.nan):
        gaps[2, 1] = bad
        with pytest.raises(RunError, match=r"1\.2500 s: 1 smarticle\(s\) \(2\): links more than 0\.0002 m apart"):
            dog.check(healthy(), floor=0.0, time=1.25, gaps=gaps)


@pytest.mark.parametrize(("density", "margin"), [(1000, SPEED_MARGIN), (20000, math.sqrt(200))])
def test_a_body_that_heavy_ones_hit_may_be_faster(density: float, margin: float) -> None:
    rods = [{"shape": "rod", "length_m": 0.01, "diameter_m": 1e-3, "count": 2, "density_kg_per_m3": each}
            for each in (100, density)]  # fmt: skip
    scene = small({"engine": "links", "count": 4, "particle": rods})
    assert build_watchdog(scene).speed == pytest.approx(margin * math.sqrt(2 * 9.81 * scene.cylinder.height))


def test_a_run_warns_of_contacts_deeper_than_half_a_link_at_its_end() -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, depth=9e-4, pressed=5e-4)
    assert dog.warn_of_depth(5e-4, 1.25) is None
    warning = dog.warn_of_depth(8.5e-4, 1.25)
    assert warning is not None
    assert warning.startswith(
        "at t = 1.2500 s contacts were 0.00085 m deep, more than 0.0005 m, half of a link's width"
    )
    assert "at least 3.4 times" in warning


def test_deep_contacts_are_named() -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, depth=6e-4)
    deep = np.zeros(4, dtype=bool)
    dog.check_depths(Overlaps(5.9e-4, deep, 0.0), time=1.25)
    deep[[1, 3]] = True
    with pytest.raises(RunError) as caught:
        dog.check_depths(Overlaps(7e-4, deep, 0.0), time=1.25)
    assert str(caught.value) == (
        "at t = 1.2500 s: 2 smarticle(s) (1, 3): contacts more than 0.0006 m deep (deepest 0.0007 m), so that links "
        "pass through each other or through the container; raise fidelity.stiffness_N_per_m, about 2.3 times, or load "
        "the pile less"
    )


@pytest.mark.parametrize(
    ("between", "way_out"),
    [
        (("the lower hook", "the upper hook"), "set hooks.upper_height_m and lower_height_m further apart than w"),
        (("the upper hook", "the wall"), "give the hook more room: a smaller hooks.length_m or a wider container"),
    ],
)
def test_a_smarticle_held_by_two_boundaries_is_named(between: tuple[str, str], way_out: str) -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, depth=6e-4)
    deep = np.array([False, True, False, True])
    with pytest.raises(RunError) as caught:
        dog.check_depths(Overlaps(7e-4, deep, 0.0, (Held(3, between, 0.0051),)), time=1.25)
    assert str(caught.value) == (
        f"at t = 1.2500 s: 2 smarticle(s) (1, 3): smarticle 3 is held by {between[0]} and {between[1]}, which have "
        f"moved apart by 0.0051 m: only its contacts can give way, the deepest by 0.0007 m; {way_out}"
    )


def watch(dog: Watchdog, *energies: tuple[float, float]) -> None:
    """Energy less work [J] and what springs hold [J], check by check."""
    for energy, elastic in energies:
        dog.check_energy(healthy(), energy=energy, elastic=elastic, time=1.25)


def test_energy_may_fall_and_springs_may_give_back_what_they_held() -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, energy=0.1)
    # Falls on to springs, which throw it back; then less and less.
    watch(dog, (5.0, 0.0), (2.0, 3.0), (4.9, 0.0), (1.0, 2.0), (2.9, 0.0), (2.0, 0.0), (0.5, 0.0), (0.5, 0.0))
    # What is within the limit, again and again, is not summed up.
    watch(dog, *[(0.59, 0.0), (0.5, 0.0)] * 10)


def test_energy_from_nowhere_stops_the_run() -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, energy=0.1)
    watch(dog, (5.0, 0.0), (0.5, 0.2))
    with pytest.raises(RunError) as caught:
        watch(dog, (0.81, 0.0))
    # Of four smarticles, one is three times as fast as the next.
    assert str(caught.value) == (
        "at t = 1.2500 s: 1 smarticle(s) (0): an energy that has risen by 0.11 J more than gravity, motors and springs "
        "explain (limit 0.1 J); these are the fastest, up to 4.9 m/s; lower fidelity.time_step_fraction"
    )


LEDGER = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, energy=4e-7, missed=0.05)


@pytest.mark.parametrize(
    ("residual", "dissipated", "verdict"),
    [
        (5.1e-10, 2.56e-9, "good"),  # a fifth of next to nothing, which lifts a pile by a thousandth of a diameter
        (7e-8, 0.0, "good"),
        (9e-8, 0.0, "warned"),
        (9e-8, 2.56e-9, "warned"),
        (-3e-7, 1e-5, "warned"),
        (4.1e-7, 0.0, "stopped"),
        (1.26e-4, 1.8e-4, "stopped"),
        (6e-5, 1e-3, "stopped"),
    ],
)
def test_the_ledger_is_judged_by_what_was_dissipated_and_by_a_height(
    residual: float, dissipated: float, verdict: str
) -> None:
    # 20 % of the limits: 5 % of the dissipation, and the energy that lifts all by half a diameter.
    if verdict == "stopped":
        with pytest.raises(RunError, match="the energy ledger misses"):
            LEDGER.check_residual(residual, dissipated=dissipated, time=1.25)
        return
    warning = LEDGER.check_residual(residual, dissipated=dissipated, time=1.25)
    assert (warning is None) == (verdict == "good")


def at(*position: float) -> State:
    still = np.zeros((1, 3))
    return State.rigid(BOXES, np.array([position], dtype=float), np.eye(3)[None], still, still)


GLANCE = {"fastest": 4.9, "lowest": 1.0, "highest": 1.09, "widest": 0.0234, "gap": 1e-5, "deepest": 1e-4}
STRICT = Watchdog(cylinder=Cylinder(radius=0.0234, height=0.1, facets=64), speed=5.0, gap=2e-5, depth=2e-4)


def content(raised: float | None = 0.0, dog: Watchdog = STRICT, **changes: float) -> bool:
    extremes = Extremes(**{**GLANCE, "elastic_energy": 0.0, **changes})
    return dog.within_limits(extremes, floor=1.0, raised=raised)


def test_extremes_within_all_limits_need_no_full_check() -> None:
    assert content()
    assert content(widest=1.0, highest=5.0, raised=None)  # nothing holds them
    assert not content(lowest=0.999, raised=None)


@pytest.mark.parametrize(
    ("name", "value"),
    [("fastest", 5.1), ("lowest", 0.999), ("highest", 1.101), ("widest", 0.0236), ("gap", 3e-5), ("deepest", 3e-4)],
)
def test_an_extreme_beyond_a_limit_or_nan_needs_a_full_check(name: str, value: float) -> None:
    assert not content(**{name: value})
    assert not content(**{name: math.nan})


def test_what_a_grip_lifts_above_the_wall_is_not_thrown_out() -> None:
    phases = [{"type": "deposit"}, {"type": "lift", "radius_m": 0.01, "distance_m": 0.04, "speed_m_per_s": 0.1}]
    scene = small({"engine": "links", "container.height_m": 0.1, "phases": phases})
    state, watchdog = healthy(), build_watchdog(scene)
    state.positions[:, 2], state.positions[:, :2] = 0.139, 0.0
    watchdog.check(state, floor=0.0, time=1.0)
    state.positions[0, 2] = 0.141
    with pytest.raises(RunError, match="thrown out over the wall"):
        watchdog.check(state, floor=0.0, time=1.0)
