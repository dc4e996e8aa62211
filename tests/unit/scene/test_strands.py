"""The number of strands follows from the section and from the thinnest body."""

from typing import Any

import numpy as np
import pytest
from scenes import small

from dem.errors import InputError
from dem.plan.doubts import doubts_of
from dem.plan.steps import time_steps
from dem.scene.scene import Scene

STAPLE: dict[str, Any] = {"shape": "staple", "crown_m": 0.0117, "leg_m": 0.0082}
WIDE = STAPLE | {"thickness_normal_m": 3e-3}
FOIL = STAPLE | {"thickness_normal_m": 3e-3, "thickness_in_plane_m": 5e-5}
THIN = {"shape": "rod", "length_m": 0.014, "diameter_m": 2e-4}


def scene(engine: str = "links", **changes: Any) -> Scene:
    return small({"engine": engine, "fidelity": "standard", **changes})


@pytest.mark.parametrize(
    ("changes", "rows"),
    [
        ({}, [2]),
        ({"fidelity": "reference"}, [3]),
        ({"fidelity": "draft", "particle": WIDE}, [1]),
        ({"particle": STAPLE}, [2]),
        ({"particle": WIDE}, [5]),
        ({"smarticle": {"thickness_normal_m": 3e-3}}, [5]),
        ({"particle": [STAPLE, THIN]}, [3, 1]),
        ({"hooks": {}}, [2]),
        ({"hooks": {"side_m": 1.5e-4}}, [3]),
        ({"particle": [WIDE | {"share": 0}, STAPLE]}, [2]),
    ],
)
def test_strands_leave_no_hole_and_are_no_more_than_before_where_there_was_none(
    changes: dict[str, Any], rows: list[int]
) -> None:
    made = scene(**changes)
    assert [getattr(body, "rows", None) or body.chain.rows for body in made.bodies] == rows
    time_steps(made)


def test_rows_of_spheres_leave_no_hole_for_a_sphere() -> None:
    (body,) = scene("yade", fidelity="reference", particle=WIDE).bodies
    centres = body.centres[body.links == 1]
    # The centre of the widest hole is farther from no sphere than two spheres that touch.
    along, across = (np.unique(np.round(centres[:, axis], 9)) for axis in (0, 2))
    assert np.hypot(np.diff(along).max(), np.diff(across).max()) <= 2 * body.diameter
    assert scene("yade", fidelity="reference").body.chain.rows == 2


@pytest.mark.parametrize(("own", "rows"), [({}, 2), ({"pitch": 1.35}, 3), ({"diameter_m": 4e-4}, 3)])
def test_rows_of_spheres_follow_from_a_pitch_and_a_diameter_of_the_scene(own: dict[str, float], rows: int) -> None:
    made = scene("yade", fidelity={"base": "reference", **own})
    assert made.body.chain.rows == rows
    time_steps(made)


@pytest.mark.parametrize("fidelity", ["draft", "standard"])
@pytest.mark.parametrize("diameter", [0.05e-3, 0.2e-3, 0.4e-3])
def test_thin_chains_of_spheres_do_not_pass_between_spheres(fidelity: str, diameter: float) -> None:
    made = scene("yade", fidelity=fidelity, particle=[STAPLE, THIN | {"diameter_m": diameter}])
    staple, rod = made.bodies
    gaps = [
        np.linalg.norm(np.diff(body.centres[body.links == k], axis=0), axis=1).max()
        for body, k in ((staple, 1), (rod, 0))
    ]
    # Crossed chains whose gaps meet, as in a projection along the normal of both.
    assert np.hypot(*gaps) / 2 <= (staple.diameter + rod.diameter) / 2 * (1 + 1e-9)


def test_a_pitch_is_kept_where_chains_do_not_pass() -> None:
    for hooks in ({}, {"hooks": {}}):
        assert scene("yade", fidelity="draft", **hooks).body.chain.pitch == pytest.approx(
            1.3 * scene("yade", fidelity="draft").body.diameter, rel=1e-15
        )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"particle": WIDE, "fidelity": {"rows": 2}}, "2 rows .*of thickness_normal_m = 0.003 m.*0.0005 m.*at least 5"),
        ({"particle": [STAPLE, THIN], "fidelity": {"base": "draft", "rows": 2}}, "2 rows .*0.0002 m pass.*at least 3"),
        ({"particle": FOIL}, "32 rows .*5e-05 m.*32 rows are too few, or 1"),
    ],
)
def test_too_few_rows_are_refused_before_a_run(changes: dict[str, Any], message: str) -> None:
    made = scene(**changes)  # recorded scenes stay readable
    with pytest.raises(InputError, match=f"fidelity.rows: {message}"):
        time_steps(made)
    time_steps(scene(**changes | {"fidelity": {"rows": 1}}))


def test_rows_follow_anew_when_a_section_is_replaced() -> None:
    assert scene(particle=WIDE).replace(particle=STAPLE).fidelity.rows == 2
    assert scene(particle=STAPLE).replace(particle=WIDE).fidelity.rows == 5


@pytest.mark.parametrize(
    ("changes", "warned"),
    [
        ({"fidelity": "draft", "particle": [WIDE, THIN]}, True),
        ({"fidelity": "standard", "particle": [WIDE, THIN]}, False),
        ({"fidelity": "draft", "particle": WIDE}, False),
        ({"fidelity": "draft", "particle": [STAPLE, THIN]}, False),
        ({"fidelity": "draft", "hooks": {}}, False),
    ],
)
def test_thin_bars_within_the_edges_of_a_round_strand_are_told(changes: dict[str, Any], warned: bool) -> None:
    warnings = [warning for warning in doubts_of(scene(**changes)) if warning.startswith("fidelity.rows")]
    assert len(warnings) == warned
    assert all("0.003 m wide" in warning and "0.0002 m" in warning for warning in warnings)
