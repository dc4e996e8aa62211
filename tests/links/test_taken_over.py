"""A pile poured on links goes on on links: nearly as if nothing had been, and always with the same bits."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import taking

import smarticles


@pytest.fixture(scope="module", params=[taking.ROUND, "standard"], ids=["one strand", "standard"])
def pour(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """A run that poured a pile, and its fidelity."""
    out = tmp_path_factory.mktemp("taken-over") / "pour"
    taking.pour("links", str(out), request.param)
    return out, request.param


def test_the_same_engine_goes_on_where_the_frame_was(pour: tuple[Path, Any]) -> None:
    source, fidelity = pour
    told = taking.taken_over("links", str(source), fidelity)
    assert told["off"] < 1e-15  # rounding of 0.1 m
    assert told["speeds"] == 0
    assert told["stops"] == 0
    # Springs of friction begin anew, so that the pile creeps by a little: 0.003 to 0.02 diameters at most, in 3 piles
    # of 60 at 500 and at 250 N/m; each pushes as deep as before, and what a new pour has apart is a diameter and more.
    assert 0 < told["moved"].max() < 0.03 * told["diameter"]
    assert told["moved"].mean() < 0.005 * told["diameter"]
    # It only goes down in energy, by less than contacts at rest are deep.
    assert -0.01 * told["diameter"] < told["gained"] < 0


def test_twice_it_has_the_same_bits(pour: tuple[Path, Any]) -> None:
    source, fidelity = pour
    one, other = (taking.taken_over("links", str(source), fidelity) for _ in range(2))
    assert np.array_equal(one["vertices"], other["vertices"])


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pile, whose barbs then opened to 60° and stayed there."""
    ramp = {"type": "ramp", "to_deg": 60, "duration_s": 0.2}
    scene = smarticles.Scene(
        **{
            **{key: value for key, value in taking.POUR.items() if key != "schema_version"},
            "engine": "links",
            "count": 3,
            "phases": [{"type": "deposit"}, {"type": "actuate", "barbs": ramp}, {"type": "relax", "duration_s": 0.2}],
        }
    )
    out = tmp_path_factory.mktemp("taken-over") / "opened"
    smarticles.run(scene, out)
    return out


def begun(opened: Path, angles: tuple[float, float]) -> smarticles.Scene:
    return smarticles.Scene(
        **{
            **{key: value for key, value in taking.POUR.items() if key != "schema_version"},
            "engine": "links",
            "count": 3,
            "smarticle": {"angles_deg": angles},
            "phases": [
                {"type": "take-over", "run": str(opened)},
                {"type": "actuate", "barbs": {"type": "ramp", "to_deg": 90, "duration_s": 0.2}},
            ],
        }
    )


def test_barbs_that_have_moved_become_the_scene_s_own_angles(opened: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"angles_deg: \(90, 90\) here, but the barbs of frame .* at (59|60).*°"):
        begun(opened, (90.0, 90.0))
    run = smarticles.run(begun(opened, (60.0, 60.0)), tmp_path / "closed")
    source = smarticles.read(opened).frames[-1]
    assert np.degrees(source.cell_data["angle_rad"][:, [0, 2]]) == pytest.approx(60, abs=0.1)
    first, last = run.frames[0], run.frames[-1]
    assert np.linalg.norm(first.vertices - source.vertices + [0, 0, source.floor_z], axis=-1).max() < 0.2e-3
    # The last frame is up to an interval of 0.04 s, 6° of the way, before the end.
    assert np.degrees(last.cell_data["angle_rad"][:, [0, 2]]) == pytest.approx(87, abs=3.1)
