"""What the engine wrote is what `postprocess` reads: frames, series and measures have the engine's own numbers."""

from pathlib import Path
from typing import Any

import cases
import numpy as np
import pytest

from dem.record.run import Run
from postprocess import measure_run, read_frames, summarise_run

SCENE: dict[str, Any] = {
    "schema_version": 1,
    "name": "handover",
    "seed": 5,
    "count": 6,
    "fidelity": "draft",
    "phases": [
        {"type": "deposit", "per_layer": 3},
        {"type": "relax", "duration_s": 0.04},
        {"type": "shake", "duration_s": 0.08, "frequency_hz": 30, "peak_acceleration_g": 2},
        {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 0.08},
    ],
    "recording": {"frame_interval_s": 0.02, "checkpoint_interval_s": 0.04, "energy": True},
}
SETTLED = 0.02  # m/s, speed below which the pour of this scene counts as settled, see `smarticles plan`
Notes = dict[float, dict[str, Any]]


@pytest.fixture(scope="module")
def handed(worker: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Notes]:
    """A run directory, and what the engine said at every sample of its series, by time."""
    out = tmp_path_factory.mktemp("handover") / "run"
    return out, {note["time"]: note for note in worker.submit(cases.noted, SCENE, str(out)).result(300)}


def test_frames_hold_the_engine_s_numbers_to_the_bit(handed: tuple[Path, Notes]) -> None:
    out, notes = handed
    frames = read_frames(out)
    assert len(frames) > 10
    assert {frame.phase for frame in frames} == {0, 1, 2, 3}
    driven = 0
    for frame in frames:
        note = notes[frame.time]
        state = note["state"]
        assert (frame.phase, frame.floor_z, frame.count) == (note["phase"], note["floor"], state.count)
        for ours, theirs in (
            (frame.vertices, state.vertices),
            (frame.link_velocity, state.link_velocities),
            (frame.link_angular_velocity, state.link_spins),
            (frame.contacts, note["contacts"]),
            (frame.cell_data["angle_rad"][:, [0, 2]], state.angles),
        ):
            np.testing.assert_array_equal(ours, theirs)
        torques = frame.cell_data["motor_torque_N_m"][:, [0, 2]]
        driven += note["torques"] is not None
        np.testing.assert_array_equal(torques, np.nan if note["torques"] is None else note["torques"])
    assert driven > 2
    assert any(frame.contacts.any() for frame in frames)


def test_measures_agree_with_the_engine(handed: tuple[Path, Notes]) -> None:
    out, notes = handed
    run = Run(out)
    table, series = measure_run(run, costly="never"), run.series
    for _, row in table.iterrows():
        note = notes[row["time [s]"]]
        # Hinges give way by a little, and vertices stand for both links that meet there.
        near = 1e-9 if note["torques"] is None else 1e-5
        heights = note["state"].positions[:, 2] - note["floor"]
        assert row["com height [m]"] == pytest.approx(heights.mean(), rel=near)
        assert row["contacts mean [-]"] == note["contacts"].mean()
        assert row["kinetic energy [J]"] == note["state"].kinetic_energy
        phi = series["packing_fraction"][series.nearest(row["time [s]"])]
        speeds = np.linalg.norm(note["state"].velocities, axis=1)
        if row["phase type"] == "deposit" and (len(speeds) < SCENE["count"] or speeds.max() > SETTLED):
            assert np.isnan(row["phi second-highest-com [-]"])
        else:
            assert row["phi second-highest-com [-]"] == pytest.approx(phi, rel=near)
    summary = summarise_run(Run(out), costly="never")
    assert summary["phase type"].tolist() == [phase["type"] for phase in SCENE["phases"]]
    assert summary["phi second-highest-com [-]"].gt(0).all()
