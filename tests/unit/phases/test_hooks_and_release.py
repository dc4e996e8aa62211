"""Scenes with hooks, a wall that is removed, or a mould of tiers: their defaults."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import small

from dem.phases.pull_hook import PullHook
from dem.plan.outlook import warnings_of
from dem.setting.hooks import Cross

W, T2 = 0.0117, 0.5e-3
DEPOSIT = {"type": "deposit"}
PULL = {"type": "pull-hook"}
TIERS = [{"radius_m": 0.0234, "height_m": 0.012}, {"radius_m": 0.018, "height_m": 0.012}]


def test_hooks_follow_from_the_smarticle_by_default() -> None:
    scene = small({"hooks": {}, "phases": [DEPOSIT, PULL]})
    assert scene.hooks is not None
    lower, upper = scene.hooks.crosses
    assert lower == Cross(height=10 * T2, side=T2, length=W)
    assert upper == replace(lower, height=20 * T2)
    pull = scene.phases[1]
    assert isinstance(pull, PullHook)
    assert (pull.which, pull.distance_m, pull.speed_m_per_s, pull.duration_s) == ("upper", 2 * W, W, 2.0)
    other = small({"smarticle.middle_length_m": 0.02, "hooks": {"side_m": 1e-3}, "phases": [DEPOSIT, PULL]})
    assert other.hooks is not None
    assert (other.hooks.side_m, other.hooks.length_m, other.hooks.upper_height_m) == (1e-3, 0.02, 20 * T2)
    assert other.phases[1].model_dump()["distance_m"] == 0.04


def test_tiers_give_the_widest_radius_and_the_whole_height() -> None:
    scene = small({"container": {"tiers": [*TIERS, {"radius_m": 0.018, "height_m": 0.1}]}})
    assert (scene.container.radius_m, scene.container.height_m) == (0.0234, pytest.approx(0.124))
    # Two tiers of one radius are one wall: no ceiling of no width between them.
    assert scene.cylinder.upper == ((0.012, 0.018),)
    assert scene.cylinder.radii(np.array([0.0, 0.012, 0.0121, 1.0])).tolist() == [0.0234, 0.0234, 0.018, 0.018]


def test_the_wall_is_high_enough_for_the_hooks() -> None:
    assert small({"hooks": {"upper_height_m": 0.3}}).cylinder.height > 0.3 + W
    # A pile that stands higher than the hooks needs no more than without them.
    many = {"count": 300}
    assert small({"hooks": {}, **many}).cylinder.height == small(many).cylinder.height


def test_a_hook_that_leaves_a_gap_as_wide_as_a_link_at_the_wall_wedges_none() -> None:
    changes = {"engine": "links", "hooks": {}, "count": 400, "phases": [DEPOSIT, PULL | {"force_limit_N": 1.0}]}
    assert warnings_of(small(changes)) == ()
    (warning,) = warnings_of(small(changes | {"hooks": {"length_m": 0.0455}}))
    assert warning.startswith("hooks.length_m: the bars of the upper hook end 0.0006")
    advised = float(warning.partition("use at most ")[2].partition(" m")[0])
    assert warnings_of(small(changes | {"hooks": {"length_m": advised}})) == ()


@pytest.mark.parametrize(("fidelity", "width"), [("draft", 2 * (1.27e-3 + T2) / math.pi), ("standard", 1.27e-3)])
def test_the_gap_between_a_hook_and_the_wall_is_compared_with_the_wide_side_of_links(
    fidelity: str, width: float
) -> None:
    changes = {"engine": "links", "fidelity": fidelity, "hooks": {}, "count": 400, "phases": [DEPOSIT, PULL]}
    inner = small(changes).cylinder.inner_radius

    def warned(gap: float) -> bool:
        # The bars' corners are the outermost points.
        length = 2 * math.sqrt((inner - gap) ** 2 - (T2 / 2) ** 2)
        return any("wedged" in warning for warning in warnings_of(small(changes | {"hooks": {"length_m": length}})))

    assert warned(width - 2e-5)
    assert not warned(width + 2e-5)
