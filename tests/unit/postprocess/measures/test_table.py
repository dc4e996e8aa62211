"""Tables of runs: a row per frame, a row per phase."""

import h5py
import numpy as np
import pytest

import postprocess
from dem.record.run import Run
from postprocess import (
    link_crossings,
    measure_run,
    open_run,
    packing_fraction,
    read_frames,
    summarise_run,
)
from postprocess.measures.packing import COSTLY_DEFINITIONS

CHEAP = [name for name in postprocess.DEFINITIONS if name not in COSTLY_DEFINITIONS]
PHI = "phi second-highest-com [-]"


def test_one_row_per_frame_with_every_measure(make_run):
    directory = make_run()
    table = measure_run(Run(directory))
    frame, manifest = read_frames(directory)[2], open_run(directory)
    row = table.iloc[2]
    assert len(table) == 3
    assert (row["name"], row["seed"], row["phase type"], row["frame"]) == ("pile", 7, "shake", 2)
    assert (row["scene_sha256"], row["fidelity"], row["count"]) == ("abc", "draft", 6)
    assert row["aspect ratio [-]"] == 0.7
    assert row["time [s]"] == pytest.approx(0.2)
    assert row["crossings mean [-]"] == link_crossings(frame.vertices).mean() > 0
    assert row["contacts mean [-]"] == 2.5
    assert row["escaped [-]"] == 0
    expected = packing_fraction(
        frame.vertices,
        radius=manifest.manifest.container_radius_m,
        solid_volume=manifest.manifest.solid_volume_m3,
        floor_z=-0.002,
    )
    assert row[PHI] == expected.value
    assert row["second-highest com height [m]"] == expected.height
    assert row["kinetic energy [J]"] == pytest.approx(2.0)
    assert row["container force z [N]"] == pytest.approx(0.6)
    assert row["unbalanced force [-]"] == pytest.approx(0.8)
    # One smarticle has no packing fraction.
    assert np.isnan(table[PHI][0])


def test_columns_of_motors_and_energies_where_there_are_any(make_run):
    directory = make_run()
    columns = {
        "angle_rad": (np.array([[1.5, 1.5], [1.4, 1.3], [0.1, 0.2]]), "rad"),
        "motor_work_J": (np.array([0.0, 1e-6, 3e-6]), "J"),
        "halted_fraction": (np.array([np.nan, 0.5, 0.25]), "1"),
        "gravitational_energy_J": (np.array([1e-4, 2e-4, 3e-4]), "J"),
    }
    with h5py.File(directory / "series.h5", "a") as file:
        for name, (values, unit) in columns.items():
            file.create_dataset(name, data=values).attrs.update({"unit": unit, "description": name})
    table = measure_run(Run(directory), definitions=CHEAP)
    assert table["angle barb 1 [degree]"].tolist() == pytest.approx([85.9437, 80.2141, 5.72958], rel=1e-5)
    assert table["angle barb 2 [degree]"].tolist() == pytest.approx([85.9437, 74.4845, 11.4592], rel=1e-5)
    assert table["motor work [J]"].tolist() == [0.0, 1e-6, 3e-6]
    assert table["halted fraction [-]"].tolist()[1:] == [0.5, 0.25]
    assert table["gravitational energy [J]"].iloc[-1] == 3e-4
    assert "motor work [J]" not in measure_run(Run(make_run()), definitions=CHEAP)
    summary = summarise_run(Run(directory), definitions=CHEAP)
    assert summary["motor work [J]"].iloc[-1] == 3e-6
    assert np.isnan(summary["halted fraction [-]"][0])


@pytest.mark.parametrize("angles", [(0.0, 0.0), (90.0, 0.0), (105.0, -15.0)])
def test_measures_take_any_shape(make_run, scene, write_frame, angles):
    """Straight smarticles have no plane, so no crossings; everything else is defined."""
    directory = make_run()
    pile = scene(6, 3, box=1.5, width=11.7e-3, angles=angles) - [0.006, 0.006, 0.0]
    path = write_frame(directory, pile, time=0.2, phase=2, floor_z=-0.002)
    path.rename(directory / "frames" / "frame_000002.vtu")
    row = measure_run(Run(directory)).iloc[2]
    straight = angles == (0.0, 0.0)
    assert row["smarticles with a plane [-]"] == (0 if straight else 6)
    assert np.isnan(row["crossings mean [-]"]) == straight
    middles = (pile[:, 1:] + pile[:, :-1]) / 2
    weights = np.array([0.7, 1.0, 0.7]) / 2.4
    expected = (middles[..., 2] * weights).sum(axis=1).mean() + 0.002
    assert row["com height [m]"] == pytest.approx(expected)
    assert row[["phi second-highest-com [-]", "phi top-percentile [-]", "phi voxel [-]"]].notna().all()


def test_summary_averages_the_last_frames_of_each_phase(make_run):
    plan = [(0, 0.0), (1, 0.0), *((2, 0.001 * k) for k in range(5))]
    directory = make_run(plan)
    frames, summary = measure_run(Run(directory)), summarise_run(Run(directory), last=3)
    assert summary["phase type"].tolist() == ["deposit", "relax", "shake"]
    assert summary["frames averaged"].tolist() == [0, 1, 3]  # the pour has not ended
    last = frames[frames["phase"] == 2][-3:]
    shake = summary.iloc[2]
    assert shake[PHI] == pytest.approx(last[PHI].mean())
    assert shake["phi second-highest-com SE [-]"] > 0
    assert shake["phi voxel [-]"] == pytest.approx(last["phi voxel [-]"].iloc[-1], nan_ok=True)
    assert np.isnan(summary["com height SE [m]"][1])
    assert (shake["name"], shake["seed"]) == ("pile", 7)


RECORDING = "recording: {frame_interval_s: 0.1, series_interval_s: 0.05}\n"


def test_the_frame_at_the_end_of_a_phase_gives_its_state_and_no_weight_to_means(make_run):
    plan = [(0, 0.0), (1, 0.0), *((2, 0.001 * k) for k in range(5))]
    # The frames at 0.235 s and 0.63 s end their phases.
    run = Run(make_run(plan, times=[0.1, 0.235, 0.3, 0.4, 0.5, 0.6, 0.63]))
    with (run.path / "scene.yaml").open("a") as file:
        file.write(RECORDING)
    frames = measure_run(run)
    assert run.at_intervals(run.frames.in_phase(1)).times.tolist() == [0.235]
    assert run.at_intervals(run.frames.in_phase(2)).times.tolist() == [0.3, 0.4, 0.5, 0.6]
    assert run.at_intervals(run.frames.in_phase(2)[:3]).times.tolist() == [0.3, 0.4, 0.5]
    rest, shake = summarise_run(run, last=3).iloc[1], summarise_run(run, last=3).iloc[2]
    assert (rest["frames averaged"], shake["frames averaged"]) == (1, 3)
    assert rest[PHI] == frames[PHI][1]
    assert shake[PHI] == pytest.approx(frames[PHI][3:6].mean())
    assert (rest["time [s]"], shake["time [s]"]) == (0.235, 0.63)
    voxel = "phi voxel [-]"
    assert np.isfinite(shake[voxel]) == np.isfinite(frames[voxel].iloc[-1])
    assert shake[voxel] == pytest.approx(frames[voxel].iloc[-1], nan_ok=True)


def test_a_phase_without_a_frame_has_a_row_of_what_its_series_tells(make_run):
    run = Run(make_run([(0, 0.0), (2, 0.0), (2, 0.001)]))
    assert summarise_run(run)["phase"].tolist() == [0, 1, 2]
    empty = summarise_run(run).iloc[1]
    assert (empty["phase type"], empty["frames averaged"], empty["name"]) == ("relax", 0, "pile")
    assert empty[["time [s]", PHI, "com height [m]", "kinetic energy [J]"]].isna().all()
    assert summarise_run(run, phases={1})["phase"].tolist() == [1]
    # A phase that has not begun has no row.
    assert summarise_run(Run(make_run([(0, 0.0), (1, 0.0)])))["phase"].tolist() == [0, 1]


def test_values_of_the_series_are_those_of_the_frames_phase(make_run):
    run = Run(make_run([(0, 0.0), (1, 0.0), (2, 0.0)], times=[0.0, 0.16, 0.2]))
    with h5py.File(run.path / "series.h5", "a") as file:
        file["time_s"][:] = [0.0, 0.1, 0.17]
    row = measure_run(run).iloc[1]
    assert row["kinetic energy [J]"] == 1.6  # of the sample at 0.1 s, although that at 0.17 s is nearer


def test_a_measure_that_is_named_fills_every_frame(make_run):
    run = Run(make_run([(1, 0.0), (1, 0.0), (1, 0.0), (2, 0.001)]))
    found = measure_run(run, also=["crossing-number"])
    assert found["average crossing number mean [-]"].notna().all()
    # Of measures that nobody named, costly ones are for the last frame of a phase.
    voxel = next(name for name in found.columns if "voxel" in name)
    assert found[voxel].notna().tolist() == [False, False, True, True]
