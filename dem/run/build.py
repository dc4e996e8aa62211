"""Make the parts of a run from its scene: engine, recorder, watchdog."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem.arrays import Array
from dem.body.kinds import Mixture
from dem.body.particle import LINKS, mean_width
from dem.body.state import PileState, spheres_of
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.engine.kinds import engine_kind
from dem.phases.actuated import BARB_LINKS, MOST_OVERSHOOT, overshoot
from dem.phases.pull_hook import PullHook
from dem.plan.effects import called_for
from dem.plan.steps import time_steps
from dem.record.frames import FrameWriter, OneFileWriter
from dem.record.names import FORCE, SPHERE
from dem.record.progress import ProgressWriter
from dem.record.series import SeriesWriter
from dem.run.recorder import Recorder
from dem.run.sampler import Sampler
from dem.run.watchdog import LOWER_STEP, Watchdog
from dem.scene import stiffness
from dem.scene.reading import scene_hash
from dem.scene.scene import Scene

GAP_LIMIT = 0.2  # gap of a hinge in sphere diameters; it is up to 0.01 in a pile and 0.02 at an impact of 3 m/s
# The same at a joint of chains, whose pins give way about as much as contacts; links could pass through wider gaps.
PIN_LIMIT = 0.5
# Limit of speeds, over the speed of a fall over the container's height, of the shaking or of motors. In mixtures with
# masses in a ratio of more than its square, the lightest body with all the kinetic energy of a heaviest one is faster.
SPEED_MARGIN = 5.0
# Overlap in sphere diameters, from which on the forces of wall and floor decrease or point outwards, and chains slip
# through each other. Shaking at Γ = 10 with the fidelity draft reaches 0.4.
DEPTH_LIMIT = 0.5
# On links, whose contacts stiffen without bound before axes meet; under the weight of 100 piles overlaps are smaller.
BARRIER_LIMIT = 0.9
# Overlap in sphere diameters from which on a run on links warns at its end: the largest one that `plan` expects.
PRESSED = stiffness.LIMIT
# Fraction of the dissipation that the energy ledger of links may miss; on YADE it depends on the sampling interval.
MISSED_LIMIT = 0.05
# Limit of an unexplained rise of the energy: what lifts all smarticles by so many sphere diameters, a height below the
# resolution of all results.
RISE_LIMIT = 0.5
# The limit is at least this fraction of the kinetic energy at the greatest speed that a phase or a motor gives to
# smarticles, since collisions without loss, and fast barbs, conserve it to that accuracy only.
KEPT_WITHIN = 0.01

DAMP_SHAFTS = (
    "damp the shafts by motor.damping_N_m_s_per_rad (engine: links) or lower motor.stiffness_N_m_per_rad, since a "
    "control update turns an undamped shaft far beyond its torque limit, and barbs ring on it"
)


def build_engine(scene: Scene, dt: float) -> Engine:
    """Return the engine for a scene: a simulation to which no smarticles have been added yet.

    `dt` is the shortest time step of all phases [s]; whether it is stable is not checked.
    """
    return engine_kind(scene.engine).build(scene, dt)


def build_recorder(scene: Scene, out: Path, progress: ProgressWriter) -> Recorder:
    """Return the recorder of a scene, with the watchdog that it calls."""
    recording = scene.recording
    # A mould of tiers has no single radius, and a plane has none.
    radius = math.nan if scene.cylinder.upper or scene.plane else scene.container.measured_radius
    effects = called_for(scene)
    sampler = Sampler(radius, effects)
    return Recorder(
        sampler=sampler,
        series=SeriesWriter(out, sampler.described, {"scene_sha256": scene_hash(scene), "seed": scene.seed}),
        frames=_frame_writer(scene, out),
        watchdog=build_watchdog(scene),
        points=watched_points(scene),
        progress=progress,
        interval=recording.series_interval_s,
        frame_every=recording.samples_in(recording.frame_interval_s),
        forces=FrameWriter(out, FORCE) if EffectName.CONTACT_FORCES in effects else None,
        spheres=FrameWriter(out, SPHERE) if EffectName.SPHERE_GLYPHS in effects else None,
        sphere_every=recording.samples_in(recording.sphere_interval_s),
    )


def _frame_writer(scene: Scene, out: Path) -> FrameWriter:
    if scene.recording.frames == "vtu":
        return FrameWriter(out)
    # No tube about the axis is a flat bar of several rows: one that others meet at an equal mean distance.
    if scene.mixture is not None:
        radii = [kind.radius if kind.rows == 1 else mean_width(*kind.thicknesses) / 2 for kind in scene.mixture.kinds]
        return OneFileWriter(out, radii=radii, kind="kind")
    particle, boxes = scene.body, scene.smarticle.boxes
    if particle.chain.rows == 1 and not boxes.bulge:
        return OneFileWriter(out, radii=[particle.radius] * LINKS)
    radii = [mean_width(boxes.thickness_normal, in_plane) / 2 for in_plane in boxes.thicknesses_in_plane]
    return OneFileWriter(out, radii=radii)


def watched_points(scene: Scene) -> Callable[[PileState], Array]:
    """Return a function that gives the points (N, P, 3) [m] of a state that the watchdog checks.

    The points are the centres of all spheres, or the ends and middles of smooth links.
    """
    model = scene.model
    if isinstance(model, Mixture):
        return lambda state: spheres_of(state, model)
    particle = model
    if not scene.smooth:
        return lambda state: spheres_of(state, particle)
    # The first, the middle and the last sphere of each straight row of the chain that represents a link in pictures.
    places = np.column_stack([particle.links, np.round(particle.local_centres[:, 1:] / particle.radius, 6)])
    which = []
    for row in np.unique(places, axis=0):
        (numbers,) = np.nonzero((places == row).all(axis=1))
        along = numbers[np.argsort(particle.local_centres[numbers, 0])]
        which += [along[0], along[len(along) // 2], along[-1]]
    kept = np.unique(which)
    return lambda state: state.smarticles.spheres(particle, kept)


def build_watchdog(scene: Scene) -> Watchdog:
    """Return the watchdog of a scene, with its limits."""
    gravity, diameter = scene.gravity_m_per_s2, scene.sphere_diameter
    fall = math.sqrt(2 * gravity * (scene.cylinder.height + sum(phase.raises for phase in scene.phases)))
    fastest = max(speed_by_motors(scene), *(phase.peak_speed(gravity) for phase in scene.phases))
    mass, masses = scene.count * scene.model.mass, [body.mass for body in scene.bodies]
    return Watchdog(
        cylinder=scene.cylinder,
        speed=max(SPEED_MARGIN, math.sqrt(max(masses) / min(masses))) * max(fall, fastest, speed_by_overlap(scene)),
        way_out=DAMP_SHAFTS if _rings(scene) else LOWER_STEP,
        floats=scene.mixture is not None
        and any(kind.filament is not None and kind.filament.weight_share < 0 for kind in scene.mixture.kinds),
        lifted=max(0.0 if isinstance(phase, PullHook) else phase.raises for phase in scene.phases),
        gap=(PIN_LIMIT if scene.mixture is not None and scene.mixture.jointed else GAP_LIMIT) * diameter,
        depth=(BARRIER_LIMIT if scene.smooth else DEPTH_LIMIT) * diameter,
        pressed=PRESSED * diameter if scene.smooth else math.inf,
        missed=MISSED_LIMIT if scene.smooth else math.inf,
        # Without gravity no height corresponds to an energy.
        energy=mass * max(RISE_LIMIT * diameter * gravity, KEPT_WITHIN * fastest**2 / 2) if gravity else math.inf,
    )


def speed_by_overlap(scene: Scene) -> float:
    """Return the speed [m/s] that a contact gives to the lightest point of a body in the poses with which a run begins.

    The contact is as deep as these poses may overlap, δ; the speed is δ √(kn/m).
    """
    lightest = min(
        body.smallest_effective_mass if body.filament is None else float(body.filament.masses.min())
        for body in scene.bodies
    )
    depth = scene.phases[0].overlap * scene.sphere_diameter
    return depth * math.sqrt(scene.fidelity.stiffness_N_per_m / lightest)


def _rings(scene: Scene) -> bool:
    """Return whether control updates may make the barbs ring on their shafts."""
    return scene.actuates and scene.motor.damping_N_m_s_per_rad == 0 and overshoot(scene) > MOST_OVERSHOOT


def speed_by_motors(scene: Scene) -> float:
    """Return the greatest speed [m/s] that a motor gives to a link: by turning it, and when the shaft springs back.

    A shaft is twisted by its torque limit, half a turn at most, and by what the motor turns in a control period. One
    link may receive all its energy: a light link on a stiff shaft becomes faster than the motor.
    """
    motors: list[tuple[float, float, float, float, float]] = []  # speed, length, stiffness, torque limit, mass
    if scene.mixture is not None:
        for linkage in (kind.linkage for kind in scene.mixture.kinds if kind.linkage is not None):
            length, mass = max(link.lengths[0] for link in linkage.links), min(link.mass for link in linkage.links)
            joints = [joint for joint in linkage.joints if joint.law == "motor"]
            motors += [(joint.speed, length, joint.stiffness, joint.most, mass) for joint in joints]
    elif scene.actuates:
        boxes, speed = scene.smarticle.boxes, scene.motor.speed_limit_rad_per_s
        mass = float(boxes.link_masses[[*BARB_LINKS]].min())
        motors = [(speed, boxes.barb_length, scene.motor.stiffness_N_m_per_rad, scene.torque_limit, mass)]
    interval = scene.fidelity.control_interval_s
    return max(
        (
            float(speed * length + (min(limit / stiffness, math.pi) + speed * interval) * math.sqrt(stiffness / mass))
            for speed, length, stiffness, limit, mass in motors
        ),
        default=0.0,
    )


@dataclass(frozen=True)
class Builders:
    """Functions that make a run's time steps (one per phase [s]), engine and recorder; tests replace them."""

    steps: Callable[[Scene], Sequence[float]] = time_steps
    engine: Callable[[Scene, float], Engine] = build_engine
    recorder: Callable[[Scene, Path, ProgressWriter], Recorder] = build_recorder
