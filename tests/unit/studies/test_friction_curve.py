"""The friction at which a curve of φ is Gravish's, its interval, and how surely φ is near."""

import math

import numpy as np
import pytest

from studies.friction.curve import Curve

FRICTION = np.array([0.2, 0.4, 0.6, 0.8])
# Two thousandths of φ per hundredth of friction.
PACKING = 0.20 - 0.2 * (FRICTION - 0.2)


def curve(packing=PACKING, *, half_width=0.004, reference=0.15, reading=0.0, friction=FRICTION, freedom=20):
    widths = np.full(len(packing), half_width)
    return Curve(
        friction=np.asarray(friction, dtype=float),
        packing=np.asarray(packing, dtype=float),
        half_widths=widths,
        reference=reference,
        reading_error=reading,
        per_error=2.0859634,  # t(0.975; 20)
        freedom=freedom,
    )


def test_a_straight_line_is_crossed_where_it_is_gravishs():
    found = curve().crossing()
    assert (found.value, found.place) == (pytest.approx(0.45), "within the range")


def test_the_error_of_friction_is_that_of_packing_over_the_slope():
    """Just at a measured point, where nothing is interpolated, but for neighbours that are known better in between."""
    found = curve(reference=0.16, half_width=0.0004).crossing()  # at 0.4
    assert found.low == pytest.approx(0.4 - 0.0004 / 0.2, abs=0.0011)
    assert found.high == pytest.approx(0.4 + 0.0004 / 0.2, abs=0.0011)
    wider = curve(reference=0.16, half_width=0.008).crossing()
    # (1 - t)^2 + t^2 of two equal errors: 0.008 sqrt(0.702) at t = 0.182, 0.2 * 0.2 * t = 0.0073.
    assert wider.high == pytest.approx(0.4 + 0.2 * 0.1708, abs=0.002)
    assert wider.low == pytest.approx(0.4 - 0.2 * 0.1708, abs=0.002)


def test_gravishs_own_error_widens_the_interval():
    bare, read = curve(half_width=0.0).crossing(), curve(half_width=0.0, reading=0.006).crossing()
    assert bare.high - bare.low == pytest.approx(0.0, abs=0.002)
    assert (read.low, read.high) == (pytest.approx(0.42, abs=0.002), pytest.approx(0.48, abs=0.002))


@pytest.mark.parametrize(
    ("reference", "value", "place"),
    [(0.05, math.inf, "above the range"), (0.25, -math.inf, "below the range")],
)
def test_beyond_what_was_measured_is_said_and_not_extrapolated(reference, value, place):
    found = curve(reference=reference).crossing()
    assert (found.value, found.place) == (value, place)
    assert (found.low, found.high) == ((0.8, math.inf) if value > 0 else (-math.inf, 0.2))


def test_beyond_by_less_than_the_error_the_interval_reaches_back():
    found = curve(reference=0.079, half_width=0.004).crossing()  # the last point is 0.08
    assert found.place == "above the range"
    assert 0.75 < found.low < 0.8
    assert found.high == math.inf


def test_an_interval_is_open_where_the_last_point_is_not_excluded():
    found = curve(reference=0.082, half_width=0.004).crossing()
    assert found.place == "within the range"
    assert found.value == pytest.approx(0.79)
    assert found.high == math.inf
    assert curve(reference=0.198).crossing().low == -math.inf


def test_scatter_that_crosses_twice_gives_the_middle():
    found = curve([0.20, 0.148, 0.152, 0.10]).crossing()
    first, last = 0.2 + 0.2 * 50 / 52, 0.6 + 0.2 * 2 / 52
    assert found.value == pytest.approx((first + last) / 2)
    assert found.low < first
    assert found.high > last


def test_without_errors_there_is_a_crossing_and_no_interval():
    found = curve(half_width=math.nan).crossing()
    assert found.value == pytest.approx(0.45)
    assert math.isnan(found.low)
    assert math.isnan(found.high)
    assert math.isnan(curve(half_width=math.nan).within(0.01, 0.4))


def test_one_point_is_a_curve_too():
    one = curve([0.16], friction=[0.4], reference=0.16)
    assert (one.crossing().value, one.crossing().low, one.crossing().high) == (0.4, -math.inf, math.inf)
    assert curve([0.16], friction=[0.4]).crossing().place == "above the range"


def test_confidence_is_that_of_the_interval():
    # Right at Gravish's and with a margin of its half-width, that is what 95 % means.
    assert curve(reference=0.16).within(0.004, 0.4) == pytest.approx(0.95, abs=1e-6)
    # At the margin itself it is one half, less what lies beyond the other side.
    assert curve(reference=0.15).within(0.01, 0.4) == pytest.approx(0.5, abs=1e-3)
    assert curve(reference=0.10).within(0.01, 0.4) < 1e-6
    assert curve(reference=0.16, reading=0.1).within(0.004, 0.4) < 0.1
