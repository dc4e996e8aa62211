"""Check that the parts of a scene fit together, and that the engine can compute them."""

import math
from collections.abc import Iterator

import numpy as np

from dem.errors import rounded_up
from dem.phases.kinds import KINDS
from dem.phases.phase import Phase, SceneView
from dem.phases.place import Place
from dem.phases.pull_hook import PullHook
from dem.phases.remove_container import RemoveContainer
from dem.phases.shake import check_shaking
from dem.setting.hooks import TOLERANCE, Hooks
from dem.setting.motor import Motor
from dem.setting.smarticle import Smarticle


def problems(scene: SceneView, engine: str) -> Iterator[str]:
    """Yield an error message for each problem of a scene on an engine: key, value and what to do."""
    if scene.mixture is not None:
        yield from _of_particle(scene)
    yield from _of_bending(scene, engine)
    if scene.plane is None:
        yield from _of_order(scene)
        yield from _of_container(scene)
    else:
        yield from _of_plane(scene)
    if scene.mixture is None:
        yield from _of_section(scene)
        yield from _of_body(scene)
    yield from _of_recording(scene)
    if scene.motor.damping_N_m_s_per_rad and scene.motor.law != "servo" and engine != "links":
        yield (
            f"motor.damping_N_m_s_per_rad: {scene.motor.damping_N_m_s_per_rad:g} N m s/rad with law "
            f"{scene.motor.law} on engine: {engine}; use engine: links or law: servo, or leave it out"
        )
    for index, phase in enumerate(scene.phases):
        if engine != "links" and (what := beyond(phase)):
            yield f"phases.{index} ({phase.kind}): {what}: only engine: links computes that; use it, or leave it out"
        yield from phase.check(scene, index)
        if phase.vibrated_by is not None:
            yield from check_shaking(scene, f"phases.{index}.vibration", phase.vibrated_by)
            yield from _of_windows(index, phase)
    if scene.hooks is not None:
        yield from _of_bars(scene.hooks)
        yield from _of_room(scene, scene.hooks)
    if engine == "lammps":
        yield from _of_lammps(scene)


def _of_windows(index: int, phase: Phase) -> Iterator[str]:
    """Yield an error for a window of a vibration that begins when its phase is over."""
    windows, length = phase.vibrated_by.windows_s if phase.vibrated_by else None, phase.known_duration
    for number, (on, off) in enumerate(windows or ()):
        if length is not None and on >= length:
            yield (
                f"phases.{index}.vibration.windows_s.{number}: [{on:g}, {off:g}] s begins after the end of the phase, "
                f"which takes {length:.6g} s; leave it out, or lengthen the phase"
            )


def _of_order(scene: SceneView) -> Iterator[str]:
    for index, phase in enumerate(scene.phases):
        if phase.planar:
            yield f"phases.{index}: {phase.kind} needs motion confined to a plane; add the key plane"
    begins = [phase.begins for phase in scene.phases]
    if not begins[0] or sum(begins) > 1:
        kinds = ", ".join(phase.kind for phase in scene.phases)
        yield f"phases: got {kinds}; a run starts with one 'deposit', 'place' or 'take-over' and has no other"


def _of_plane(scene: SceneView) -> Iterator[str]:
    planar = ", ".join(kind.tag() for kind in KINDS if kind.planar is not False)
    for index, phase in enumerate(scene.phases):
        if phase.planar is False:
            yield f"phases.{index}: {phase.kind} has no meaning in a plane; use {planar}, or leave plane out"
        if phase.begins != (index == 0):
            yield f"phases.{index}: {phase.kind}; a run in a plane starts with one 'arrange' and has no other"
    if scene.hooks is not None:
        yield "hooks: they lie out of the plane; leave hooks or plane out"
    if scene.container != type(scene.container)():
        yield "container: a scene in a plane has none; leave container out, and give plane.width_m for two walls"
    if scene.fidelity.rows != 1:
        yield f"fidelity.rows: {scene.fidelity.rows} rows of spheres out of the plane; use 1"


def _of_particle(scene: SceneView) -> Iterator[str]:
    """Yield an error for each key or phase that needs smarticles, in a scene of other bodies."""
    if scene.smarticle != Smarticle():
        yield "smarticle: describes smarticles, but particle has other shapes; leave smarticle or particle out"
    if scene.motor != Motor() and scene.protocol is None:
        yield "motor: other shapes have no hinges; leave motor or particle out"
    if scene.plane is not None:
        yield "plane: motion in a plane is that of smarticles; leave plane or particle out"
    for index, phase in enumerate(scene.phases):
        if phase.actuates or phase.of_smarticles:
            yield (
                f"phases.{index}: {phase.kind} needs smarticles, which have barbs, but particle has other shapes; "
                "leave the phase or particle out"
            )


def _of_bending(scene: SceneView, engine: str) -> Iterator[str]:
    """Yield an error for each key or phase that does not go with filaments or chains, or that needs them."""
    kinds = () if scene.mixture is None else scene.mixture.kinds
    shapes = {kind.name if kind.bends else "" for kind in kinds} or {""}
    if scene.liquid is not None and "filament" not in shapes:
        yield "liquid: only filaments float in it; add particle: {shape: filament, …}, or leave liquid out"
    for index, phase in enumerate(scene.phases):
        if phase.bends and not shapes & phase.bends:
            named = " or ".join(sorted(phase.bends))
            yield (
                f"phases.{index}: {phase.kind} needs {named}s; add particle: {{shape: {named}, …}}, or leave the "
                "phase out"
            )
    if shapes == {""}:
        return
    yield from _of_floating(scene)
    bent = max(shapes)
    if engine == "yade" and bent == "filament":
        yield from _of_nodes(scene)
    elif engine != "links":
        yield f"particle: {bent} on engine: {engine}, which has none; use engine: links"
    if len(shapes) > 1:
        yield f"particle: {bent}s and other shapes do not mix; use shapes that are all {bent}, or none of them"
    if scene.recording.contact_forces:
        yield f"recording.contact_forces: forces at contacts of {bent}s are not recorded; leave it out"
    for index, phase in enumerate(scene.phases):
        if phase.kind == "take-over":
            yield f"phases.{index}: take-over reads runs of rigid bodies only; use 'deposit', or 'place' with a frame"


def _of_floating(scene: SceneView) -> Iterator[str]:
    """Yield an error for filaments that are poured but do not sink in their liquid."""
    if scene.mixture is None or scene.liquid is None or not scene.phases[0].pours:
        return
    for filament in (kind.filament for kind in scene.mixture.kinds):
        if filament is not None and filament.weight_share <= 0:
            yield (
                f"particle.density_kg_per_m3: {filament.density:g} kg/m³ is no more than liquid.density_kg_per_m3 = "
                f"{scene.liquid.density_kg_per_m3:g} kg/m³, so that filaments do not sink and nothing comes down in "
                "phases.0; use a higher density or a lower one of the liquid, or start with 'place'"
            )


def _of_nodes(scene: SceneView) -> Iterator[str]:
    """Yield an error for each part of a scene that filaments on YADE cannot have."""
    lifted = (
        f"phases.{index}.speed_m_per_s"
        for index, phase in enumerate(scene.phases)
        if isinstance(phase, RemoveContainer) and phase.speed_m_per_s is not None
    )
    edges = [*(["hooks"] if scene.hooks else []), *(["container.tiers"] if scene.cylinder.upper else []), *lifted]
    for key in edges:
        yield f"{key}: on engine: yade only the nodes of filaments touch boundaries, not edges; use engine: links"
    if scene.recording.dissipation_interval_s is not None:
        yield (
            "recording.dissipation_interval_s: on engine: yade what contacts of filaments dissipate is not added up; "
            "leave it out, or use engine: links"
        )


def _of_section(scene: SceneView) -> Iterator[str]:
    rows, t1 = scene.fidelity.rows, scene.smarticle.thickness_normal_m
    diameter = scene.sphere_diameter
    if rows > 1 and diameter >= t1:
        yield (
            f"fidelity.rows: {rows} rows of {diameter:g} m do not fit into thickness_normal_m = {t1:g} m; "
            "use one row or a smaller diameter_m"
        )


def _of_body(scene: SceneView) -> Iterator[str]:
    thickness = scene.smarticle.middle_thickness_in_plane_m
    if thickness is None:
        return
    key = f"smarticle.middle_thickness_in_plane_m: {thickness:g} m"
    if scene.plane is None:
        yield f"{key} in a scene without the key plane; links of their own thickness move in a plane, or leave it out"
    if scene.smooth:
        yield f"{key} on engine: links, where all links have one thickness; use engine: yade, or leave it out"
    particle = scene.body
    least = particle.barb_start + particle.radius
    if particle.boxes.bulge and 0 < particle.boxes.barb_length < least:
        yield (
            f"{key} leaves no room for a sphere of barbs that reach {particle.boxes.barb_length:.4g} m from the hinge; "
            f"use barbs of at least {rounded_up(least, 4)} m (aspect_ratio "
            f"{rounded_up(least / particle.boxes.middle_length)}), or a "
            "thinner middle link"
        )


def _of_container(scene: SceneView) -> Iterator[str]:
    radius, reach = scene.container.radius_m, scene.model.reach
    body, bodies = ("a smarticle", "smarticles") if scene.mixture is None else ("a body", "bodies")
    tiers = scene.container.tiers or ()
    for key, inner in (
        ("radius_m", radius),
        *((f"tiers.{number}.radius_m", tier.radius_m) for number, tier in enumerate(tiers)),
    ):
        if reach > inner and not isinstance(scene.phases[0], Place):  # which checks the poses themselves
            yield (
                f"container.{key}: {inner:g} m is narrower than {body}, whose farthest point is {reach:.4g} m "
                f"from its centre of mass; use at least {rounded_up(reach, 4)} m"
            )
    height = scene.container.height_m
    if height is not None:
        # No random packing of thin bars reaches a packing fraction near 0.5, however it is poured.
        space = math.fsum(t.radius_m**2 * t.height_m for t in tiers) if tiers else radius**2 * height
        most = int(0.5 * math.pi * space / scene.model.volume)
        if scene.count > most:
            way_out = "make the top tier higher" if tiers else "leave height_m out"
            yield (
                f"count: {scene.count} {bodies} cannot fit into {height:g} m of container.height_m "
                f"(half full is {most}); lower the count or {way_out}"
            )


def _of_recording(scene: SceneView) -> Iterator[str]:
    series = scene.recording.series_interval_s
    for key in ("frame_interval_s", "sphere_interval_s", "checkpoint_interval_s"):
        interval = getattr(scene.recording, key)
        if interval is None:
            continue
        if abs(interval / series - round(interval / series)) > 1e-6 or interval < series:
            yield (
                f"recording.{key}: {interval:g} s is not a whole multiple of series_interval_s = {series:g} s; "
                f"use e.g. {max(1, round(interval / series)) * series:g} s"
            )
    sampled = scene.recording.dissipation_interval_s
    if sampled is not None and sampled > series:
        yield (
            f"recording.dissipation_interval_s: {sampled:g} s is longer than series_interval_s = {series:g} s, so "
            "that the energy ledger would not close; 2e-4 s is dense enough"
        )
    for number, phase in enumerate(scene.phases):
        # The duration of a pour is unknown, and laying out a chain takes no time.
        duration = phase.known_duration
        if duration and duration < series:
            # The duration of some phases is the sum of several keys.
            key = ".duration_s" if "duration_s" in getattr(type(phase), "model_fields", {}) else ""
            yield (
                f"phases.{number}{key}: {duration:g} s is shorter than "
                f"recording.series_interval_s = {series:g} s; lengthen the phase or sample more often"
            )


def _of_bars(hooks: Hooks) -> Iterator[str]:
    side, lower = f"side_m = {hooks.side_m:g} m", hooks.lower_height_m
    for key, length in (("length_m", hooks.length_m), ("lower_length_m", hooks.lower_length_m)):
        if hooks.side_m > length:
            yield f"hooks.side_m: {hooks.side_m:g} m is more than {key} = {length:g} m; bars are long and thin"
    if hooks.side_m * hooks.lower_bars > hooks.lower_length_m / 2:
        yield (
            f"hooks.lower_bars: {hooks.lower_bars} bars of {side} leave no room between them over "
            f"lower_length_m = {hooks.lower_length_m:g} m; use fewer"
        )
    if lower < hooks.side_m / 2:
        yield (
            f"hooks.lower_height_m: {lower:g} m puts bars of {side} into the floor; use at least {hooks.side_m / 2:g} m"
        )
    if hooks.upper_height_m < lower + hooks.side_m * (1 - TOLERANCE):
        yield (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is not above the lower hook, whose top is at "
            f"{lower + hooks.side_m / 2:g} m; use at least {lower + hooks.side_m:g} m"
        )


def _of_room(scene: SceneView, hooks: Hooks) -> Iterator[str]:
    cylinder, top = scene.cylinder, hooks.upper_height_m + hooks.side_m / 2
    pulled = next((k for k, phase in enumerate(scene.phases) if isinstance(phase, PullHook)), None)
    highest = scene.ample_height()
    if pulled is not None and top - hooks.side_m > highest:
        yield (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is above all that {scene.count} smarticles can reach "
            f"while they are poured, {highest:.3g} m, so that phases.{pulled} (pull-hook) would feel nothing; lower it"
        )
    if top > cylinder.height:
        yield (
            f"hooks.upper_height_m: {hooks.upper_height_m:g} m is outside the container, whose wall ends at "
            f"{cylinder.height:g} m; use at most {cylinder.height - hooks.side_m / 2:g} m"
        )
    # Tiers are narrower upwards: a hook that fits into the highest tier that it reaches fits into all below.
    raised = sum(phase.raises for phase in scene.phases if isinstance(phase, PullHook))
    free = float(cylinder.inner_radii(np.array([top + raised]))[0])
    lowest = float(cylinder.inner_radii(np.array([hooks.lower_height_m + hooks.side_m / 2]))[0])
    lower, upper = hooks.crosses
    for key, cross, room in (("length_m", upper, free), ("lower_length_m", lower, lowest)):
        # The bars of a grid end at a disc, their corners half a side beyond its edge.
        beyond = hooks.side_m / 2 if cross.count > 1 else 0.0
        if cross.reach + beyond >= room:
            most = 2 * math.sqrt(max(0.0, (room - 2 * beyond) ** 2 - (hooks.side_m / 2) ** 2))
            yield (
                f"hooks.{key}: {cross.length:g} m is inside the wall, whose flats are {room:.4g} m from the axis; use "
                f"less than {most:.4g} m"
            )


def foreign(scene: SceneView) -> Iterator[str]:
    """Yield the parts of a scene that LAMMPS and similar codes cannot compute, each as key and name.

    Such codes compute only passive chains of spheres in a cylinder.
    """
    if scene.plane is not None:
        yield "plane: motion in a plane"
    if scene.hooks is not None:
        yield "hooks"
    if scene.cylinder.upper:
        yield "container.tiers"
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, RemoveContainer) and phase.speed_m_per_s is not None:
            yield f"phases.{index}.speed_m_per_s: a wall that is lifted (use null, gone at once)"
        elif phase.actuates:
            yield f"phases.{index} ({phase.kind}): motors"
        elif what := beyond(phase):
            yield f"phases.{index} ({phase.kind}): {what}"


def beyond(phase: Phase) -> str:
    """Return what of a phase only the engine links computes, in words; "" if every engine computes it."""
    return phase.needs_links or ("vibration" if phase.vibrated_by is not None else "")


def _of_lammps(scene: SceneView) -> Iterator[str]:
    found = list(foreign(scene))
    if scene.recording.energy:
        found.append("recording.energy: the work of the container is not added up")
    if scene.recording.dissipation_interval_s is not None:
        found.append("recording.dissipation_interval_s: what contacts dissipate is not added up")
    if scene.recording.contact_forces:
        found.append("recording.contact_forces: forces at contacts are not read from LAMMPS")
    if found:
        yield f"engine: lammps cannot compute {'; '.join(found)}; leave that out, or use engine: yade or links"
