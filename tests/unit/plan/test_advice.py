"""Warnings about a scene: intervals longer than the run, knobs that do nothing."""

from __future__ import annotations

import json

import pytest
from scenes import small

from dem.plan.outlook import plan, warnings_of


def test_a_plain_scene_has_no_warnings() -> None:
    assert warnings_of(small()) == ()
    assert plan(small()).warnings == ()


@pytest.mark.parametrize(
    ("key", "left_out"), [("frame_interval_s", "no frame is written"), ("sphere_interval_s", "no spheres are written")]
)
def test_an_interval_longer_than_the_run_gives_a_warning(key: str, left_out: str) -> None:
    assert warnings_of(small({f"recording.{key}": 0.88})) == ()
    scene = small({f"recording.{key}": 10.0})
    (warning,) = plan(scene).warnings
    assert warning == (
        f"recording.{key}: 10 s is longer than the whole run, about 0.9 s, so that {left_out}; shorten it, or lengthen "
        "the run"
    )
    assert warning == warnings_of(scene)[0]
    assert f"warning: {warning}" in plan(scene).to_text().splitlines()
    assert json.loads(json.dumps(plan(scene).to_dict()))["warnings"] == [warning]


def test_knobs_that_do_nothing_on_links_give_a_warning_where_they_are_set() -> None:
    assert warnings_of(small({"engine": "links"})) == ()
    knobs = {"base": "draft", "pitch": 0.5, "wall_facets": 128}
    assert warnings_of(small({"fidelity": knobs})) == ()
    (warning,) = warnings_of(small({"engine": "links", "fidelity": knobs}))
    assert warning == (
        "fidelity: pitch (0.5), wall_facets (128) have no meaning on the engine links; leave out what does nothing"
    )
