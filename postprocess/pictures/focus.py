"""One smarticle, and all that passes through its plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from dem.errors import InputError
from postprocess.geometry.links import Floats, plane_frames
from postprocess.measures.entanglement import has_plane, link_passages
from postprocess.pictures.canvas import MILLIMETRE, Canvas, Caption, Look, drawn, rectangle
from postprocess.pictures.shot import Shot
from postprocess.report import figures

_OTHERS = "#c4ccd4"
_ASKEW = np.radians([25.0, 20.0])  # how far the camera looks past the normal, across and along the middle link


def focused(shot: Shot, index: int, smarticle: int, size: tuple[int, int]) -> Image.Image:
    """Draw one smarticle and those that pass through its plane.

    It is orange, the plane through its four vertices faintly so; links that pass through are blue, other links of
    theirs grey. The camera looks through its mouth, somewhat askew.

    Args:
        shot: The run.
        index: Of the frame.
        smarticle: Number of the smarticle, as in `smarticle_id` of the frames.
        size: Width and height [pixel].

    Raises:
        InputError: There is no such smarticle, the run is in a plane, or the size is bad.
        RunError: This machine lacks the libraries to draw without a display.
    """
    frame, run = shot.frames[index], shot.run
    if run.manifest.planar:
        msg = f"smarticle {smarticle}: in a plane no link passes through another smarticle; draw the whole run"
        raise InputError(msg)
    found = np.flatnonzero(frame.smarticle_ids == smarticle)
    if not len(found):
        low, high = frame.smarticle_ids.min(), frame.smarticle_ids.max()
        msg = f"smarticle {smarticle}: there are {low} to {high} at {frame.time:g} s; choose one of these"
        raise InputError(msg)
    own = int(found[0])
    passages = link_passages(frame.vertices)
    through = passages.i == own
    shown = np.unique([own, *passages.j[through]])
    part = replace(
        frame,
        vertices=frame.vertices[shown],
        smarticle_ids=frame.smarticle_ids[shown],
        link_velocity=frame.link_velocity[shown],
        link_angular_velocity=frame.link_angular_velocity[shown],
        contacts=frame.contacts[shown],
        cell_data={name: values[shown] for name, values in frame.cell_data.items()},
    )
    colours = np.empty((len(shown), 3, 3), dtype=np.uint8)
    colours[:] = _bytes(_OTHERS)
    colours[shown == own] = _bytes(figures.ORANGE)
    colours[np.searchsorted(shown, passages.j[through]), passages.link[through]] = _bytes(figures.BLUE)
    links, others = int(through.sum()), len(shown) - 1
    said = "straight: it has no plane"
    if has_plane(frame.vertices[own][None])[0]:
        said = f"{links} link{'s' * (links != 1)} of {others} other{'s' * (others != 1)} through its plane"
    caption = Caption(
        f"{run.manifest.name}: smarticle {smarticle}",
        (
            f"{said}   t = {frame.time:.3f} s ({run.phases[frame.phase].type})",
            "orange: the smarticle, faintly its plane; blue: links through it",
        ),
    )
    axes = _through_the_mouth(frame.vertices[own])
    look = replace(Look.checked(run, color_by="id", size=size, view="front"), axes=axes)
    boxes = {"smarticles": drawn(shot.bodies, part, axes[2])["smarticles"]}
    with Canvas(look, rectangle(boxes.values(), axes), run) as canvas:
        canvas.add_patch((frame.vertices[own] - [0.0, 0.0, frame.floor_z]) * MILLIMETRE, figures.ORANGE)
        canvas.show(0, part, boxes, colours, caption)
        return canvas.image()


def _through_the_mouth(vertices: Floats) -> Floats:
    """Return axes (3, 3): right, along the middle link, up, towards the mouth, and forward; turned by `_ASKEW`."""
    normal = plane_frames(vertices[None])[0, 2]
    right = vertices[2] - vertices[1]
    right -= (right @ normal) * normal
    right /= np.linalg.norm(right)
    up = np.cross(-normal, right)
    if up @ (vertices[[0, 3]].mean(axis=0) - vertices[[1, 2]].mean(axis=0)) < 0:
        normal, up = -normal, -up
    across, along = _ASKEW
    forward = -normal * np.cos(across) + right * np.sin(across)
    forward = forward * np.cos(along) - up * np.sin(along)
    forward /= np.linalg.norm(forward)
    aside = np.cross(forward, up)
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(aside, forward), forward])


def _bytes(colour: str) -> NDArray[np.uint8]:
    return np.round(255 * np.array(to_rgb(colour))).astype(np.uint8)
