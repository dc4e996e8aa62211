"""Draw single bodies side by side, as a scene describes them."""

from collections.abc import Sequence

import numpy as np
import pyvista as pv
from PIL import Image

from dem.record.document import Kind
from dem.record.frame import RecordedBars
from postprocess.bodies.colours import ColourScale
from postprocess.bodies.fields import BY_NAME
from postprocess.bodies.meshes import bar_meshes, joined, link_boxes
from postprocess.geometry.links import Vertices
from postprocess.pictures.canvas import MILLIMETRE, Canvas, Style, axes_from, extent

_VIEW = (-70.0, 50.0)  # azimuth and elevation of the camera [degree]; bodies lie flat
_GAP = 0.3  # distance of neighbours over the length of the longest body


def draw_smarticle(
    vertices: Vertices, thickness_normal: float, thickness_in_plane: Sequence[float], *, size: int, title: str
) -> Image.Image:
    """Draw one smarticle with vertices (4, 3) and thicknesses of its links [m]; `size` is in pixels."""
    mesh = link_boxes(
        np.asarray(vertices)[None], thickness_normal=thickness_normal, thickness_in_plane=thickness_in_plane
    )
    return _draw([mesh], [""], size=size, title=title)


def draw_bars(
    bodies: Sequence[RecordedBars], kinds: Sequence[Kind], names: Sequence[str], *, size: int, title: str
) -> Image.Image:
    """Draw bodies of bars with their names; `RecordedBars.kind` is a place in `kinds`, `size` is in pixels."""
    return _draw([bar_meshes(body, kinds) for body in bodies], names, size=size, title=title)


def _draw(meshes: Sequence[pv.PolyData], names: Sequence[str], *, size: int, title: str) -> Image.Image:
    """Draw meshes of bodies [m] beside each other, each in the colour of its name in the legend."""
    wide = max(mesh.length for mesh in meshes) * MILLIMETRE
    placed, edge = [], 0.0
    for mesh in meshes:
        low, high, *_ = (MILLIMETRE * bound for bound in mesh.bounds)
        placed.append(mesh.scale(MILLIMETRE).translate((edge - low, 0.0, 0.0)))
        edge += high - low + _GAP * wide
    scale = ColourScale(kind="name", labels={float(k): name for k, name in enumerate(names)})
    colours = np.repeat(scale.painted(np.arange(len(placed))), [mesh.n_cells for mesh in placed], axis=0)
    style = Style(field=BY_NAME["entry"], size=(size, size), axes=axes_from(*_VIEW))
    with Canvas(style, extent(placed, style.axes), None, scale=scale if any(names) else None) as canvas:
        canvas.show(0, None, {"smarticles": joined(placed)}, colours, [title])
        return canvas.image()
