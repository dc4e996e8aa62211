"""Bodies of links laid so densely that their outline is known, in moulds that they fill, half fill, or miss."""

import math

import numpy as np
import pytest

from postprocess.geometry.outline import outlines
from postprocess.geometry.voxel import Region
from postprocess.measures.mould import cast

T = 1e-3
BALL = 4e-3
GAP = 1.2e-3  # between links: the ball dips in between them by no more than GAP²/(2 BALL + T), 0.2 mm


def line(start, end):
    return np.linspace(start, end, 4)


def block(radius, low, high):
    """Upright needles on rings in a cylinder, closer than the ball is wide, their surfaces on its faces."""
    inner = radius - T / 2
    feet = [(0.0, 0.0)]
    for ring in np.linspace(GAP, inner, math.ceil(inner / GAP)):
        number = math.ceil(2 * math.pi * ring / GAP)
        turns = 2 * math.pi * np.arange(number) / number
        feet += [(ring * math.cos(turn), ring * math.sin(turn)) for turn in turns]
    return np.array([line([x, y, low + T / 2], [x, y, high - T / 2]) for x, y in feet])


def brick(size, corner):
    """Level needles along x in a box, their surfaces on its faces."""
    low = np.asarray(corner) + T / 2
    high = np.asarray(corner) + np.asarray(size) - T / 2
    ys, zs = (np.linspace(low[k], high[k], math.ceil((high[k] - low[k]) / GAP) + 1) for k in (1, 2))
    return np.array([line([low[0], y, z], [high[0], y, z]) for y in ys for z in zs])


TIERS = [Region(radius=0.02, bottom=0.0, top=0.01), Region(radius=0.013, bottom=0.01, top=0.02)]


def compared(before, after, tiers=TIERS, **changes):
    return cast(before, after, tiers, **{"thickness": T, "ball": BALL, **changes})


def test_a_box_of_links_has_the_volume_of_the_box():
    pile = brick((0.03, 0.02, 0.015), (-0.01, 0.0, 0.0))
    found = outlines([pile], thickness=T, ball=BALL, pitch=BALL / 8)
    assert found.pitch**3 * found.inside.sum() == pytest.approx(0.03 * 0.02 * 0.015, rel=0.03)


def test_a_gap_that_the_ball_does_not_enter_is_part_of_the_pile_and_a_wider_one_is_not():
    size = (0.01, 0.02, 0.02)

    def volume(gap):
        pair = np.concatenate([brick(size, (0.0, 0.0, 0.0)), brick(size, (0.01 + gap, 0.0, 0.0))])
        found = outlines([pair], thickness=T, ball=BALL)
        return found.pitch**3 * found.inside.sum() / (0.02 * 0.02)

    # Faces along the grid read an eighth of a voxel too far out each, and the corners on the floor are rounded.
    assert volume(2.6 * BALL) == pytest.approx(0.02, rel=0.09)
    # Across the mouth of the narrow one the ball dips in: by 0.54 of its radius where the gap is 1.2 radii.
    assert volume(1.2 * BALL) == pytest.approx(0.02 + 1.2 * BALL, rel=0.1)


def test_a_full_mould_is_full_and_an_empty_tier_is_empty():
    both = np.concatenate([block(0.02, 0.0, 0.01), block(0.013, 0.0, 0.02)])
    full = compared(both, both)
    assert full.filled_before == pytest.approx([1, 1], abs=0.02)
    assert (full.filled_after == full.filled_before).all()
    assert full.kept.tolist() == [1, 1]
    assert full.overlap == 1
    # Less the corner above the step, which the ball does not reach into.
    assert full.likeness == pytest.approx(1, abs=0.08)
    assert full.likeness == full.likeness_before
    assert full.material_before.sum() == pytest.approx(1, abs=1e-3)
    lower = compared(block(0.02, 0.0, 0.0098), both)
    assert lower.filled_before[0] == pytest.approx(0.98, abs=0.02)
    assert lower.filled_before[1] == 0
    assert math.isnan(lower.kept[1])
    assert lower.material_before.tolist() == [1, 0]


def test_a_brick_that_moved_overlaps_by_what_is_left():
    size, shift = (0.03, 0.02, 0.015), 0.01
    before = brick(size, (-0.015, -0.01, 0.0))
    tiers = [Region(radius=0.05, bottom=0.0, top=0.015)]
    found = compared(before, before + np.array([shift, 0, 0]), tiers)
    assert found.overlap == pytest.approx((0.03 - shift) / (0.03 + shift), rel=0.04)
    assert found.kept[0] == pytest.approx(1 - shift / 0.03, rel=0.03)
    away = compared(before, before + np.array([0.09, 0, 0]), tiers)
    assert (away.overlap, away.kept[0], away.likeness) == (0, 0, 0)
    assert away.likeness_before > 0


def test_what_falls_into_the_tier_below_is_no_longer_in_its_own():
    upper = block(0.013, 0.01, 0.02)
    found = compared(upper, upper - np.array([0, 0, 0.01]))
    assert found.material_before.tolist() == [0, 1]
    assert found.material_after.tolist() == [1, 0]
    assert found.kept[1] == pytest.approx(0, abs=0.02)
    assert found.filled_after[0] == pytest.approx((0.013 / 0.02) ** 2, rel=0.05)
