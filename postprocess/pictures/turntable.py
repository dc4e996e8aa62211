"""Pictures of one frame from all around, for a page on which it is turned without a script."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image
from scipy.spatial import ConvexHull, QhullError

from postprocess.pictures.camera import VIEWS, Look, circle, extent
from postprocess.pictures.canvas import Canvas
from postprocess.pictures.colouring import ColourScale
from postprocess.pictures.shot import Shot, span_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

VIEWS_AROUND = 24
"""Pictures of a turntable, every 15°."""

_SIZE = (600, 560)  # pixel, with what stands around the panel, which is left out
_ELEVATION = 26.0  # degree
_QUALITY = 80  # of WebP; boxes have hard edges


def turntable(directory: Path | str, *, views: int = VIEWS_AROUND, color_by: str | None = None) -> list[bytes]:
    """The last frame of a run, seen from all around at one distance.

    Args:
        directory: A run directory with at least one frame.
        views: How many, at equal angles; the first one from the front.
        color_by: Key of `COLOURINGS`; as in pictures if not given.

    Returns:
        WebP files.

    Raises:
        InputError: No frame, or a damaged one.
        RunError: This machine lacks the libraries to draw without a display.
    """
    shot = Shot.of(directory)
    index = len(shot.frames) - 1
    frame = shot.frames[index]
    named = Look.checked(
        color_by=color_by or ("id" if shot.run.manifest.planar else "crossings"), size=_SIZE, view="front"
    )
    looks = [
        replace(named, azimuth=VIEWS["front"][0] + 360.0 * number / views, elevation=_ELEVATION)
        for number in range(views)
    ]
    values = shot.values([index], named)[0]
    colours = ColourScale.of(named.colouring, *span_of([values])).colours(values)
    room = turned_extent(np.concatenate([extent(frame, shot.run, look, shot.around) for look in looks]))
    pictures = []
    for look in looks:
        with Canvas(shot.run, look, shot.around, room, quick=True) as canvas:
            panel = canvas.panel(frame, colours)
        content = io.BytesIO()
        Image.fromarray(panel).save(content, "WEBP", quality=_QUALITY, method=4)
        pictures.append(content.getvalue())
    return pictures


def turned_extent(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 3) about the axis that fill as much room from every side as the given ones (m, 3) from their widest.

    A camera that has them in view stands as far away wherever it stands.
    """
    profile = np.stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]], axis=1)
    try:
        profile = profile[ConvexHull(profile).vertices]
    except QhullError:  # all on one line
        profile = np.unique(profile, axis=0)
    return np.concatenate([circle(radius, height, points=49) for radius, height in profile])
