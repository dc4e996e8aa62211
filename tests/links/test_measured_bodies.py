"""Measures of bodies of any shape, in frames of a run on links."""

from pathlib import Path

import numpy as np
import pytest
from scenes import small

from dem.record.run import Run
from dem.run.run import run_scene
from postprocess import measure_run, polygon_crossings, segments_of
from postprocess.geometry.segments import curves
from postprocess.measures.caging import contact_normals
from postprocess.measures.contacts import strands_of
from postprocess.measures.heights import frame_heights

KINDS = {
    "rod": {"length_m": 0.014},
    "staple": {"crown_m": 0.01, "leg_m": [0.007, 0.005], "angle_deg": [70, 90]},
    "c": {"radius_m": 0.005, "diameter_m": 0.8e-3},
    "ring": {"radius_m": 0.005},
    "star": {"arm_m": 0.006},
}


@pytest.fixture(scope="module", params=["draft", "standard"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    path = tmp_path_factory.mktemp("mixture") / "run"
    phases = [{"type": "deposit", "per_layer": 10}, {"type": "relax", "duration_s": 0.05}]
    particle = [{"shape": name, **sizes} for name, sizes in KINDS.items()]
    scene = {"engine": "links", "fidelity": request.param, "count": 25, "particle": particle, "phases": phases}
    run_scene(small(scene | {"container.radius_m": 0.015}), path, command="")
    return Run(path)


def test_strands_that_touch_are_the_contacts_that_the_engine_counted(run: Run) -> None:
    for frame in (run.frames[len(run.frames) // 2], run.frames[-1]):
        axes, body, _, diameter = strands_of(frame, run)
        found = contact_normals(axes, body, diameter=diameter, gap=1e-9 * float(diameter.max()))
        first, second = found.body.reshape(2, -1)
        pairs = np.unique(np.sort(np.stack([first, second], axis=1), axis=1), axis=0)
        np.testing.assert_array_equal(np.bincount(pairs.ravel(), minlength=frame.count), frame.contacts)
    assert run.frames[-1].contacts.sum() > 20


def test_recorded_shapes_are_curves_or_say_why_not(run: Run) -> None:
    frame = run.frames[-1]
    assert run.manifest.kinds is not None
    shape = [run.manifest.kinds[k].shape for k in frame.kind]
    segments, body = segments_of(frame)
    found = curves(segments, body)
    assert {s for s, one in zip(shape, found, strict=True) if one.closed} == {"ring"}
    assert {s for s, one in zip(shape, found, strict=True) if one.flaw} == {"star"}
    crossed = polygon_crossings(segments, body)
    assert {s for s, flaw in zip(shape, crossed.flaws, strict=True) if not flaw} == {"staple", "c", "ring"}
    table = measure_run(run, also=["crossing-number", "closed-linking", "orientation", "caging"]).iloc[-1]
    assert table["crossings mean [-]"] == crossed.mean > 0
    assert table["average crossing number mean [-]"] > table["closed linking number mean [-]"]
    assert 0 <= table["caged [-]"] <= table["caged against translation [-]"] <= 1
    assert table["polar order of mouths [-]"] < 1


def test_the_centre_of_mass_of_light_and_heavy_bodies_is_where_the_energy_says(tmp_path: Path) -> None:
    particle = [
        {"shape": "rod", "length_m": 0.008, "diameter_m": 2e-3, "density_kg_per_m3": 20000, "count": 3},
        {"shape": "cross", "arm_m": 0.006, "diameter_m": 1e-3, "density_kg_per_m3": 500, "count": 5},
    ]
    phases = [{"type": "deposit", "per_layer": 4}, {"type": "relax", "duration_s": 0.02}]
    scene = {"engine": "links", "fidelity": "draft", "count": 8, "particle": particle, "phases": phases}
    run_scene(small(scene | {"container.radius_m": 0.015, "recording.energy": True}), tmp_path / "run", command="")
    run = Run(tmp_path / "run")
    frame, series = run.frames[-1], run.series
    weight = 9.81 * frame.bodies.mass_kg.sum()
    energy = series["gravitational_energy_J"][series.nearest(frame.time)]
    assert frame_heights(frame, run).mean_com == pytest.approx(energy / weight, rel=1e-6)
