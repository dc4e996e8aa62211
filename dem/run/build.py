"""The parts of a run, made from its scene: engine, recorder, watchdog."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem.arrays import Array
from dem.body.state import State
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.engine.kinds import engine_kind
from dem.plan.effects import called_for
from dem.plan.steps import time_steps
from dem.record.frames import FrameWriter
from dem.record.names import FORCE, SPHERE
from dem.record.progress import ProgressWriter
from dem.record.series import SeriesWriter
from dem.run.recorder import Recorder
from dem.run.sampler import Sampler
from dem.run.watchdog import Watchdog
from dem.scene.reading import scene_hash
from dem.scene.scene import Scene

GAP_LIMIT = 0.2  # sphere diameters; a hinge holds within 0.01 in a pile and 0.02 at an impact of 3 m/s
SPEED_MARGIN = 5.0  # times the speed of a fall over the container's height, or of the shaking
# Sphere diameters: beyond it wall and floor push ever less or outwards, and chains slip through each other; shaking at
# Γ = 10, draft, reaches 0.4.
DEPTH_LIMIT = 0.5
# Sphere diameters on links, whose contacts stiffen without bound before axes meet: 100 piles on one stay below it.
BARRIER_LIMIT = 0.9
# Fraction of the dissipation that the ledger of links may miss; that of YADE is sampled, as often as a scene asks.
MISSED_LIMIT = 0.05
# Sphere diameters by which energy from nowhere could lift all smarticles: less than any height in the results resolves.
RISE_LIMIT = 0.5
# Of the kinetic energy at the greatest speed that a phase gives: collisions without loss keep it so well.
KEPT_WITHIN = 0.01


def build_engine(scene: Scene, dt: float) -> Engine:
    """Return the engine of a scene, with the time step `dt` [s] of its phases with motors, which is not checked."""
    return engine_kind(scene.engine).build(scene, dt)


def build_recorder(scene: Scene, out: Path, progress: ProgressWriter) -> Recorder:
    """Return the recorder of a scene, with the watchdog's limits."""
    recording = scene.recording
    # No one radius gives the volume of a mould of tiers.
    radius = math.nan if scene.cylinder.upper or scene.plane else scene.container.measured_radius
    effects = called_for(scene)
    sampler = Sampler(radius, effects)
    return Recorder(
        sampler=sampler,
        series=SeriesWriter(out, sampler.described, {"scene_sha256": scene_hash(scene), "seed": scene.seed}),
        frames=FrameWriter(out),
        watchdog=build_watchdog(scene),
        points=watched_points(scene),
        progress=progress,
        interval=recording.series_interval_s,
        frame_every=recording.samples_in(recording.frame_interval_s),
        forces=FrameWriter(out, FORCE) if EffectName.CONTACT_FORCES in effects else None,
        spheres=FrameWriter(out, SPHERE) if EffectName.SPHERE_GLYPHS in effects else None,
        sphere_every=recording.samples_in(recording.sphere_interval_s),
    )


def watched_points(scene: Scene) -> Callable[[State], Array]:
    """Return the (N, P, 3) points [m] that the watchdog checks: all spheres, or ends and middles of smooth links."""
    particle = scene.particle
    if not scene.smooth:
        return lambda state: state.spheres(particle)
    # The first, the middle and the last of each straight row of the chain that stands for a link in pictures.
    places = np.column_stack([particle.links, np.round(particle.local_centres[:, 1:] / particle.radius, 6)])
    which = []
    for row in np.unique(places, axis=0):
        (numbers,) = np.nonzero((places == row).all(axis=1))
        along = numbers[np.argsort(particle.local_centres[numbers, 0])]
        which += [along[0], along[len(along) // 2], along[-1]]
    kept = np.unique(which)
    return lambda state: state.spheres(particle, kept)


def build_watchdog(scene: Scene) -> Watchdog:
    """Return the watchdog of a scene, with its limits."""
    gravity, diameter = scene.gravity_m_per_s2, scene.sphere_diameter
    fall = math.sqrt(2 * gravity * (scene.cylinder.height + sum(phase.raises for phase in scene.phases)))
    fastest, mass = max(phase.peak_speed(gravity) for phase in scene.phases), scene.count * scene.smarticle.boxes.mass
    return Watchdog(
        cylinder=scene.cylinder,
        speed=SPEED_MARGIN * max(fall, fastest),
        gap=GAP_LIMIT * diameter,
        depth=(BARRIER_LIMIT if scene.smooth else DEPTH_LIMIT) * diameter,
        missed=MISSED_LIMIT if scene.smooth else math.inf,
        # Without gravity there is no such measure.
        energy=mass * max(RISE_LIMIT * diameter * gravity, KEPT_WITHIN * fastest**2 / 2) if gravity else math.inf,
    )


@dataclass(frozen=True)
class Builders:
    """Makers of the parts of a run: time step of each phase [s], engine, recorder; tests replace them."""

    steps: Callable[[Scene], Sequence[float]] = time_steps
    engine: Callable[[Scene, float], Engine] = build_engine
    recorder: Callable[[Scene, Path, ProgressWriter], Recorder] = build_recorder
