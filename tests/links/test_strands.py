"""Flat bars are solid: no axis of a bar is inside another bar, and none passes through another one."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import small

from dem.arrays import Array, Flags, Numbers
from dem.engine.links.contact import barrier
from dem.record.run import Run
from dem.run.run import run_scene
from dem.scene import strands

STAPLE = {"shape": "staple", "crown_m": 0.0117, "leg_m": 0.0082, "thickness_normal_m": 3e-3}


def poured_and_shaken(path: Path, **changes: Any) -> Run:
    phases = [{"type": "deposit", "per_layer": 4}, {"type": "shake", "duration_s": 0.1, "peak_acceleration_g": 2}]
    recording = {"series_interval_s": 1e-3, "frame_interval_s": 1e-3, "frames": "vtu"}
    run_scene(small({"engine": "links", "phases": phases, "recording": recording, **changes}), path, command="")
    return Run(path)


def axes_inside(segments: Array, normals: Array, body: Numbers, sections: Array) -> int:
    """Return the number of bars whose axis, but for its ends, is within the box of another body's bar."""
    along = np.linspace(0.02, 0.98, 33)[:, None]
    points = segments[:, None, 0] + along * (segments[:, None, 1] - segments[:, None, 0])
    found: Flags = np.zeros(len(segments), np.bool_)
    for (start, end), normal, own, (thick, in_plane) in zip(segments, normals, body, sections, strict=True):
        length = np.linalg.norm(end - start)
        u = (end - start) / length
        apart = points - start
        x, y, z = apart @ u, apart @ np.cross(normal, u), apart @ normal
        inside = (x > 0) & (x < length) & (abs(y) < in_plane / 2) & (abs(z) < thick / 2)
        found |= inside.any(axis=1) & (body != own)
    return int(found.sum())


def sides(segments: Array, body: Numbers) -> tuple[Array, Flags]:
    """Return the distances of the lines of all pairs of bars, signed, and whether the axes cross in a view.

    They cross in the view along the common normal; nearly parallel axes, whose normal may turn round, do not count.
    """
    i, j = np.triu_indices(len(segments), 1)
    p, q = segments[i, 0], segments[j, 0]
    u, v = segments[i, 1] - p, segments[j, 1] - q
    normal = np.cross(u, v)
    sines = np.linalg.norm(normal, axis=1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
    square = np.maximum((normal**2).sum(axis=1), 1e-300)
    a = (np.cross(q - p, v) * normal).sum(axis=1) / square
    b = (np.cross(q - p, u) * normal).sum(axis=1) / square
    crossed = (0 < a) & (a < 1) & (0 < b) & (b < 1) & (sines > 0.1) & (body[i] != body[j])
    return ((q - p) * normal).sum(axis=1) / np.sqrt(square), crossed


def faults(run: Run) -> tuple[int, int]:
    """Return the numbers of bars inside others, summed over frames, and of passes between successive frames."""
    inside = passes = 0
    before: tuple[Array, Flags] | None = None
    assert run.manifest.kinds is not None
    each = np.array([[kind.thickness_normal_m, kind.thickness_in_plane_m] for kind in run.manifest.kinds])
    for frame in run.frames:
        assert frame.bars is not None
        normals = frame.bars.normals
        inside += axes_inside(frame.segments, normals, frame.body, each[frame.kind[frame.body]])
        now = sides(frame.segments, frame.body)
        if before is not None and len(before[0]) == len(now[0]):
            # In a millisecond no axis moves by 1 mm over an end of another one and back.
            turned = before[0] * now[0] < 0
            passes += int((turned & before[1] & now[1] & (abs(before[0] - now[0]) < 1e-3)).sum())
        before = now
    return inside, passes


def test_bars_six_times_as_wide_as_thick_are_solid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = {"particle": STAPLE, "count": 12, "container.radius_m": 0.013}
    inside, passes = faults(poured_and_shaken(tmp_path / "solid", fidelity="standard", **scene))
    # With two strands, which a run refuses, the same pile is full of faults.
    monkeypatch.setattr(strands.Sections, "holes", lambda *_: None)
    holed = faults(poured_and_shaken(tmp_path / "holes", fidelity={"base": "standard", "rows": 2}, **scene))
    assert (inside, passes) == (0, 0)
    assert holed[0] > 100
    assert holed[1] > 10


@pytest.mark.parametrize("depth", [-0.1, 0.1, 0.25, 0.3, 0.6, 0.9])
def test_the_stretched_overlap_is_that_of_contacts(depth: float) -> None:
    expected = barrier.stretch.py_func(depth * 1e-3, 1e-3)[0]
    assert strands._stretched(depth * 1e-3, 1e-3) == pytest.approx(expected, rel=1e-12)
