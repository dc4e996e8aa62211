"""Strips of pictures: all of one scale, which is told."""

import numpy as np
from PIL import Image
from synthetic import SyntheticRun, W, u_shape, write_frame, write_run

from postprocess.pictures import strip
from postprocess.pictures.strip import Row, draw_strip


def lone(directory, places):
    """A run of one frame, smarticles flat on the floor at places (n, 3) [m]."""
    write_run(
        directory,
        SyntheticRun(count=len(places), frames_per_phase=1, phases=("relax",), packing=(0.001,), series=False),
    )
    vertices = u_shape(0.7 * W) + np.asarray(places)[:, None]
    write_frame(directory / "frames/frame_000000.vtu", vertices, time=0.5, phase=0)
    return directory


def test_a_smarticle_is_as_large_in_every_picture_of_a_strip(tmp_path, monkeypatch):
    """The second run reaches far out, and alone would be drawn from farther away than the first."""
    near, far = [[0.0, 0, 0.001]], [[0.0, 0, 0.001], [0.06, 0, 0.001]]
    rows = [
        Row(directory=lone(tmp_path / name, places), label=name, times=(0.5,))
        for name, places in (("a", near), ("b", far))
    ]
    kept = []
    pictures = strip._pictures

    def keep(rows):
        found, pixel = pictures(rows)
        kept.extend(found)
        return found, pixel

    monkeypatch.setattr(strip, "_pictures", keep)
    path = draw_strip(rows, tmp_path / "strip.png", columns=["end"], footer=["drawn by a test"])
    with Image.open(path) as opened:
        image = np.asarray(opened.convert("RGB")).astype(int)
    assert image.shape[1] > 400
    # A row of a black bar, longer than any letter, below the pictures.
    black = (image.max(axis=2) < 60)[image.shape[0] // 2 :, : image.shape[1] // 2]
    assert black.sum(axis=1).max() > 60
    wide = []
    for row in kept:
        image = np.asarray(row[0]).astype(int)
        red = image[..., 0] - image[..., 2] > 60  # smarticle 0
        wide.append(np.ptp(np.flatnonzero(red.any(axis=0))))
    assert wide[0] > 20
    assert abs(wide[0] - wide[1]) <= 1
