"""What the parts of a scene must be to each other: rules that no part can check alone.

Source of every limit: what the engine can do, or what would make a run that means nothing.
"""

from __future__ import annotations

import math

import numpy as np

from dem.phases.kinds import KINDS
from dem.phases.phase import SceneView
from dem.setting.hooks import TOLERANCE, Hooks


def check(scene: SceneView) -> None:
    """Check a scene as a whole.

    Raises:
        ValueError: one line with key, value and the way out.
    """
    if scene.plane is None:
        _check_space(scene)
        _check_order(scene)
        _check_container(scene)
    else:
        _check_plane(scene)
    _check_section(scene)
    _check_body(scene)
    _check_recording(scene)
    for index, phase in enumerate(scene.phases):
        phase.check(scene, index)
    if scene.hooks is not None:
        _check_bars(scene.hooks)
        _check_room(scene, scene.hooks)


def _check_space(scene: SceneView) -> None:
    for index, phase in enumerate(scene.phases):
        if phase.planar:
            msg = f"phases.{index}: {phase.kind} needs motion confined to a plane; add the key plane"
            raise ValueError(msg)


def _check_order(scene: SceneView) -> None:
    begins = [phase.begins for phase in scene.phases]
    if not begins[0] or sum(begins) > 1:
        kinds = ", ".join(phase.kind for phase in scene.phases)
        msg = f"phases: got {kinds}; a run starts with one 'deposit' or one 'take-over' and has no other"
        raise ValueError(msg)


def _check_plane(scene: SceneView) -> None:
    planar = ", ".join(kind.tag() for kind in KINDS if kind.planar is not False)
    for index, phase in enumerate(scene.phases):
        if phase.planar is False:
            msg = f"phases.{index}: {phase.kind} has no meaning in a plane; use {planar}, or leave plane out"
            raise ValueError(msg)
        if phase.begins != (index == 0):
            msg = f"phases.{index}: {phase.kind}; a run in a plane starts with one 'arrange' and has no other"
            raise ValueError(msg)
    if scene.hooks is not None:
        msg = "hooks: they lie out of the plane; leave hooks or plane out"
        raise ValueError(msg)
    if scene.container != type(scene.container)():
        msg = "container: a plane has none but two walls; leave container out and give plane.width_m"
        raise ValueError(msg)
    if scene.fidelity.rows != 1:
        msg = f"fidelity.rows: {scene.fidelity.rows} rows of spheres out of the plane; use 1"
        raise ValueError(msg)


def _check_section(scene: SceneView) -> None:
    rows, t1 = scene.fidelity.rows, scene.smarticle.thickness_normal_m
    diameter = scene.sphere_diameter
    if rows > 1 and diameter >= t1:
        msg = (
            f"fidelity.rows: {rows} rows of {diameter:g} m do not fit into thickness_normal_m = {t1:g} m; "
            "use one row or a smaller diameter_m"
        )
        raise ValueError(msg)


def _check_body(scene: SceneView) -> None:
    """A middle link with a thickness of its own: where it can be had, and whether barbs stand out of it."""
    thickness = scene.smarticle.middle_thickness_in_plane_m
    if thickness is None:
        return
    key = f"smarticle.middle_thickness_in_plane_m: {thickness:g} m"
    if scene.plane is None:
        msg = f"{key} in a scene without the key plane; links of their own thickness move in a plane, or leave it out"
        raise ValueError(msg)
    if scene.smooth:
        msg = f"{key} on engine: links, whose links are all as thick; use engine: yade, or leave it out"
        raise ValueError(msg)
    particle = scene.particle
    least = particle.barb_start + particle.radius
    if particle.boxes.bulge and 0 < particle.boxes.barb_length < least:
        msg = (
            f"{key} leaves nothing outside of barbs that reach {particle.boxes.barb_length:.4g} m from the hinge; "
            f"use barbs of at least {least:.4g} m (aspect_ratio {least / particle.boxes.middle_length:.3g}), or a "
            "thinner middle link"
        )
        raise ValueError(msg)


def _check_container(scene: SceneView) -> None:
    radius, reach = scene.container.radius_m, scene.particle.reach
    if reach > radius:
        msg = (
            f"container.radius_m: {radius:g} m is narrower than a smarticle, whose farthest point is {reach:.4g} m "
            f"from its centre of mass; use at least {reach:.4g} m"
        )
        raise ValueError(msg)
    tiers = scene.container.tiers or ()
    for number, tier in enumerate(tiers):
        if reach > tier.radius_m:
            msg = (
                f"container.tiers.{number}.radius_m: {tier.radius_m:g} m is narrower than a smarticle, whose "
                f"farthest point is {reach:.4g} m from its centre of mass; use at least {reach:.4g} m"
            )
            raise ValueError(msg)
    height = scene.container.height_m
    if height is not None:
        # No random packing of thin bars comes near one half; a scene beyond it cannot fit, whatever the pour.
        space = math.fsum(t.radius_m**2 * t.height_m for t in tiers) if tiers else radius**2 * height
        most = int(0.5 * math.pi * space / scene.smarticle.boxes.volume)
        if scene.count > most:
            way_out = "make the top tier higher" if tiers else "leave height_m out"
            msg = (
                f"count: {scene.count} smarticles cannot fit into {height:g} m of container.height_m "
                f"(half full is {most}); lower the count or {way_out}"
            )
            raise ValueError(msg)


def _check_recording(scene: SceneView) -> None:
    series = scene.recording.series_interval_s
    for key in ("frame_interval_s", "sphere_interval_s", "checkpoint_interval_s"):
        interval = getattr(scene.recording, key)
        if interval is None:
            continue
        if abs(interval / series - round(interval / series)) > 1e-6 or interval < series:
            msg = (
                f"recording.{key}: {interval:g} s is not a whole multiple of series_interval_s = {series:g} s; "
                f"use e.g. {max(1, round(interval / series)) * series:g} s"
            )
            raise ValueError(msg)
    sampled = scene.recording.dissipation_interval_s
    if sampled is not None and sampled > series:
        msg = (
            f"recording.dissipation_interval_s: {sampled:g} s is longer than series_interval_s = {series:g} s, so "
            "that the energy ledger would not close; 2e-4 s is dense enough"
        )
        raise ValueError(msg)
    for number, phase in enumerate(scene.phases):
        # How long a pour takes is not known, and laying out a chain takes no time.
        duration = phase.progress_duration
        if duration is not None and duration < series:
            msg = (
                f"phases.{number}{phase.duration_key}: {duration:g} s is shorter than "
                f"recording.series_interval_s = {series:g} s; lengthen the phase or sample more often"
            )
            raise ValueError(msg)


def _check_bars(hooks: Hooks) -> None:
    for key, length in (("length_m", hooks.length_m), ("lower_length_m", hooks.lower_length_m)):
        if hooks.side_m > length:
            msg = f"hooks.side_m: {hooks.side_m:g} m is more than {key} = {length:g} m; bars are long and thin"
            raise ValueError(msg)
    if hooks.side_m * hooks.lower_bars > hooks.lower_length_m / 2:
        msg = (
            f"hooks.lower_bars: {hooks.lower_bars} bars of side_m = {hooks.side_m:g} m leave no room between them over "
            f"lower_length_m = {hooks.lower_length_m:g} m; use fewer"
        )
        raise ValueError(msg)
    if hooks.lower_height_m < hooks.side_m / 2:
        msg = (
            f"hooks.lower_height_m: {hooks.lower_height_m:g} m puts bars of side_m = {hooks.side_m:g} m into the "
            f"floor; use at least {hooks.side_m / 2:g} m"
        )
        raise ValueError(msg)
    if hooks.upper_height_m < hooks.lower_height_m + hooks.side_m * (1 - TOLERANCE):
        least = hooks.lower_height_m + hooks.side_m
        msg = (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is not above the lower hook, whose top is at "
            f"{hooks.lower_height_m + hooks.side_m / 2:g} m; use at least {least:g} m"
        )
        raise ValueError(msg)


def _check_room(scene: SceneView, hooks: Hooks) -> None:
    cylinder, top = scene.cylinder, hooks.upper_height_m + hooks.side_m / 2
    pulled = next((k for k, phase in enumerate(scene.phases) if phase.raises), None)
    highest = scene.ample_height()
    if pulled is not None and top - hooks.side_m > highest:
        msg = (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is above all that {scene.count} smarticles can reach "
            f"while they are poured, {highest:.3g} m, so that phases.{pulled} (pull-hook) would feel nothing; lower it"
        )
        raise ValueError(msg)
    if top > cylinder.height:
        msg = (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is outside the container, whose wall ends at "
            f"{cylinder.height:g} m; use at most {cylinder.height - hooks.side_m / 2:g} m"
        )
        raise ValueError(msg)
    # A tier is narrower than those below it: what fits into the highest one that a hook reaches fits into all.
    raised = sum(phase.raises for phase in scene.phases)
    free = float(cylinder.inner_radii(np.array([top + raised]))[0])
    lowest = float(cylinder.inner_radii(np.array([hooks.lower_height_m + hooks.side_m / 2]))[0])
    lower, upper = hooks.crosses
    for key, cross, room in (("length_m", upper, free), ("lower_length_m", lower, lowest)):
        # Several bars end at the disc, and their corners half a side beyond it.
        beyond = hooks.side_m / 2 if cross.count > 1 else 0.0
        if cross.reach + beyond >= room:
            most = 2 * math.sqrt(max(0.0, (room - 2 * beyond) ** 2 - (hooks.side_m / 2) ** 2))
            msg = (
                f"hooks.{key}: {cross.length:g} m is inside the wall, whose flats are {room:.4g} m from the axis; use "
                f"less than {most:.4g} m"
            )
            raise ValueError(msg)
