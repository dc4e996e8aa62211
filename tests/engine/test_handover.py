"""What the engine wrote is what `postprocess` reads: frames, series and measures have the engine's own numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import handover_cases
import numpy as np
import pytest

from dem.record.run import Run
from postprocess import measure_run, read_frames, summarise_run

PHASES = ["deposit", "relax", "shake", "internal-oscillation"]
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


@pytest.fixture(scope="module")
def handed(worker: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """A run directory, and the engine's numbers at every sample of its series."""
    out = tmp_path_factory.mktemp("handover") / "run"
    notes: list[dict[str, Any]] = worker.submit(handover_cases.noted, SCENE, str(out)).result(300)
    return out, notes


def test_frames_hold_the_engine_s_numbers_to_the_bit(handed: tuple[Path, list[dict[str, Any]]]) -> None:
    out, notes = handed
    said = {note["time"]: note for note in notes}
    frames = read_frames(out)
    assert len(frames) > 10
    assert {frame.phase for frame in frames} == {0, 1, 2, 3}
    driven = 0
    for frame in frames:
        note = said[frame.time]
        assert (frame.phase, frame.floor_z, frame.count) == (note["phase"], note["floor"], note["count"])
        for ours, theirs in (
            (frame.vertices, note["vertices"]),
            (frame.link_velocity, note["velocities"]),
            (frame.link_angular_velocity, note["spins"]),
            (frame.contacts, note["contacts"]),
            (frame.cell_data["angle_rad"][:, [0, 2]], note["angles"]),
        ):
            np.testing.assert_array_equal(ours, theirs)
        torques = frame.cell_data["motor_torque_N_m"][:, [0, 2]]
        if note["torques"] is None:
            assert np.isnan(torques).all()
        else:
            driven += 1
            np.testing.assert_array_equal(torques, note["torques"])
    assert driven > 2
    assert any(frame.contacts.any() for frame in frames)


def test_measures_agree_with_the_engine(handed: tuple[Path, list[dict[str, Any]]]) -> None:
    out, notes = handed
    run, said = Run(out), {note["time"]: note for note in notes}
    table, series = measure_run(run, costly="never"), run.series
    for _, row in table.iterrows():
        note = said[row["time [s]"]]
        # Hinges give way by a little, and vertices stand for both links that meet there.
        near = 1e-9 if note["torques"] is None else 1e-5
        assert row["com height [m]"] == pytest.approx(note["heights"].mean(), rel=near)
        assert row["contacts mean [-]"] == note["contacts"].mean()
        assert row["kinetic energy [J]"] == note["kinetic_energy"]
        phi = series["packing_fraction"][series.nearest(row["time [s]"])]
        assert row["phi second-highest-com [-]"] == pytest.approx(phi, rel=near)
    summary = summarise_run(Run(out), costly="never")
    assert summary["phase type"].tolist() == PHASES
    assert summary["phi second-highest-com [-]"].gt(0).all()
