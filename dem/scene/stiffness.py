"""Estimate the overlaps in a scene from its loads and speeds, and the stiffness that it needs.

Four loads are estimated:

- the hardest impact: of the typical effective mass, at the greatest speed that a phase or a motor causes plus the speed
  of a fall from the height w, or from the top of the slab that a layer is poured into where that is higher;
- the pile's weight times 1 + Γ, shared by two contacts of each smarticle that can lie on the floor;
- the pile's weight on the four contacts of a hook that lifts it;
- the greatest force of a plate, shared by two contacts of each smarticle that can lie on the floor.

The overlap of an impact is inversely proportional to the root of the stiffness, other overlaps to the stiffness itself.
"""

import math
from typing import NamedTuple

from dem.body.particle import mean_width
from dem.phases.compress import Compress
from dem.phases.deposit import Deposit
from dem.phases.phase import SceneView
from dem.phases.pull_hook import PullHook
from dem.physics.contact import typical_effective_mass

# Overlaps over a link's mean width that `stiffness_for` aims at. The named stiffnesses have these overlaps in the
# paper's scenes up to l/w = 1.8, in a fall from the height w, so that a name has similar errors in all scenes.
WANTED = {"draft": 0.24, "standard": 0.17, "reference": 0.12}
LIMIT = 0.5  # largest overlap over a link's mean width that is accepted


class Overlap(NamedTuple):
    """An expected overlap."""

    cause: str  #: Load that causes the overlap, in words
    widths: float  #: Overlap over the mean width of a link's section, 2 (t1 + t2)/π [1]
    stiffness: float  #: kn at which `widths` would be `WANTED` for the scene's fidelity [N/m]


def expected_overlaps(scene: SceneView) -> tuple[Overlap, ...]:
    """Return the expected overlaps of a scene: by impact, by weight, and by a hook if a phase pulls it."""
    gravity, stiffness, model = scene.gravity_m_per_s2, scene.fidelity.stiffness_N_per_m, scene.model
    width, thickness = model.size, min(mean_width(*body.thicknesses) for body in scene.bodies)
    speeds = [phase.peak_speed(gravity) for phase in scene.phases]
    if scene.actuates and scene.mixture is None:
        speeds.append(scene.motor.speed_limit_rad_per_s * scene.body.boxes.barb_length)
    slabs = [phase.layer_height_w for phase in scene.phases if isinstance(phase, Deposit) and phase.every_s is None]
    speed = math.sqrt(max(speeds) ** 2 + 2 * gravity * width * max([1.0, *slabs]))
    mass = max(map(typical_effective_mass, scene.bodies))
    impact = speed * math.sqrt(mass / stiffness) / thickness
    shaken = max(phase.peak_acceleration for phase in scene.phases)
    pile = scene.count * model.mass * gravity
    lying = max(1.0, min(scene.count, math.pi * scene.cylinder.radius**2 / width**2))
    loads = {"the pile's weight": pile * (1 + shaken) / (2 * lying)}
    if any(isinstance(phase, PullHook) for phase in scene.phases):
        loads["a hook that lifts the pile"] = pile / 4
    plates = [phase.load(scene) for phase in scene.phases if isinstance(phase, Compress)]
    if any(plates):
        loads["a plate that compresses the pile"] = max(plates) / (2 * lying)
    wanted = WANTED[scene.fidelity.base]
    found = [Overlap(f"an impact at {speed:.2g} m/s", impact, (impact / wanted) ** 2 * stiffness)]
    found += [Overlap(name, load / stiffness / thickness, load / thickness / wanted) for name, load in loads.items()]
    return tuple(found)


def stiffness_for(scene: SceneView) -> float:
    """Return the least kn [N/m], rounded up to two digits, that keeps expected overlaps within `WANTED`."""
    needed = max(overlap.stiffness for overlap in expected_overlaps(scene))
    if needed <= 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(needed)) - 1)
    return math.ceil(needed / unit) * unit


def too_soft(scene: SceneView) -> str | None:
    """Return a message that contacts are too soft, if an expected overlap exceeds `LIMIT`; None otherwise."""
    worst = max(expected_overlaps(scene), key=lambda overlap: overlap.widths)
    if worst.widths <= LIMIT:
        return None
    return (
        f"fidelity.stiffness_N_per_m: at {scene.fidelity.stiffness_N_per_m:g} N/m {worst.cause} presses contacts in "
        f"by about {worst.widths:.2g} of their thickness; use about {stiffness_for(scene):.2g} N/m"
    )
