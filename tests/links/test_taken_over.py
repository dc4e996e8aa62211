"""A pile poured on links goes on on links: nearly as if nothing had been, and always with the same bits."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import taking

import smarticles
from dem.errors import InputError


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


# Axes of one round strand of 0.7 mm come nearer to each other than strands of flat bars can, as those of spheres do.
THIN: dict[str, Any] = {**taking.ROUND, "diameter_m": 0.7e-3}


@pytest.fixture(scope="module")
def thin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that poured a pile of round bars, thinner than flat ones are wide."""
    out = tmp_path_factory.mktemp("taken-over") / "thin"
    taking.pour("links", str(out), THIN)
    return out


@pytest.mark.parametrize("fidelity", ["standard", "reference"])
def test_overlapping_poses_are_pushed_apart_and_settle_in_peace(thin: Path, fidelity: str) -> None:
    # Without a push, strands that begin on the wrong side of each other throw smarticles at hundreds of m/s.
    told = taking.taken_over("links", str(thin), fidelity)
    assert told["speeds"] == 0
    assert told["stops"] == 0
    assert told["off"] > 0.1 * told["diameter"]
    # They sink by what contacts of the frame carried and those here do not yet: much less than they were pushed.
    assert told["moved"].mean() < 0.5e-3
    assert -0.5e-3 < told["gained"] < 1e-6


def on_standard(thin: Path, height: float | None = None, **recording: Any) -> smarticles.Scene:
    return smarticles.Scene(
        **{
            **{key: value for key, value in taking.POUR.items() if key != "schema_version"},
            "engine": "links",
            "fidelity": "standard",
            "container": {"height_m": height},
            "phases": [{"type": "take-over", "run": str(thin)}, {"type": "relax", "duration_s": 0.02}],
            "recording": {**taking.POUR["recording"], **recording},
        }
    )


def test_the_push_is_told_and_the_ledger_closes(thin: Path, tmp_path: Path) -> None:
    with pytest.warns(
        UserWarning, match=r"overlap by up to .* mm as this scene has its links .* pushed apart first, by"
    ):
        run = smarticles.run(on_standard(thin, dissipation_interval_s=1e-3), tmp_path / "on")
    told = run.manifest.taken_over
    assert told is not None
    assert told["pushed_most_m"] > told["pushed_mean_m"] > 0.02e-3
    assert told["overlap_m"] > 0.1e-3
    series = run.series
    assert series["dissipated_energy_J"][-1] > 0
    # A hundredth of what lifts the pile by half a diameter.
    scale = 20 * run.manifest.smarticle_mass_kg * 9.81 * 0.5e-3 / 2
    assert np.nanmax(np.abs(series["energy_residual_J"])) < 0.01 * scale


def test_too_large_a_push_is_refused_before_anything_is_computed(
    thin: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dem.phases.take_over.MOST_PUSHED", 0.01)
    scene = on_standard(thin)
    with pytest.raises(
        InputError, match=r"phases\.0\.run: poses of frame .* mm at most; at most 0\.117 mm are allowed"
    ):
        scene.phases[0].ready(scene)


def test_a_wall_that_is_too_low_for_the_push_is_named(thin: Path) -> None:
    frame = smarticles.read(thin).frames[-1]
    scene = on_standard(thin, height=float(frame.vertices[..., 2].max() - frame.floor_z) + 1e-6)
    with pytest.raises(InputError, match=r"container\.height_m: .* and then reach .* m; use a higher container"):
        scene.phases[0].ready(scene)


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
