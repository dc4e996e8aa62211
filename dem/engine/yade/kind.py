"""Facts about the engine on YADE, and the function that builds its simulations."""

from dem.engine.demand import Activity, Demand, contact_law_of, mean_spheres, motor_law_of
from dem.engine.effect import EffectName
from dem.engine.yade.construction import ADDS, ORDER
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.hinges import DAMPER_TIME, HingeLaw
from dem.engine.yade.library import yade_threads, yade_version
from dem.engine.yade.stable_step import (
    filament_stable_time_step,
    hinged_stable_time_step,
    planar_stable_time_step,
    stable_time_step,
)

# Wall seconds per sphere and step in a dense pile, one core, measured with `make bench` (see README); machines
# differ by a factor of two.
COST_PER_SPHERE_STEP = 3.3e-7
# The same per node of a filament and step, most of it for internal damping in Python.
COST_PER_NODE_STEP = 7e-6
# Factors on this cost. A pour costs about half as much as the full pile, since the pile grows from nothing; with motors
# each smarticle has three bodies and four bonds, and there are control updates.
FACTORS = {Activity.POUR: 0.5, Activity.ACTUATE: 1.7}


class YadeKind:
    """`dem.engine.kinds.EngineKind` of YADE."""

    name = "yade"
    workers = "threads"
    damps_once_per_update = True
    idle_knobs: tuple[str, ...] = ()
    adds = ADDS
    order = ORDER
    version = staticmethod(yade_version)
    threads = staticmethod(yade_threads)

    def stable_step(self, scene: Demand, *, articulated: bool) -> float:
        law = contact_law_of(scene)
        if articulated and scene.channel is not None:
            return planar_stable_time_step(scene.body, law, hinge_law(scene), scene.pulled_by)
        rods = [body.filament for body in scene.bodies if body.filament is not None]
        if rods:
            return min(filament_stable_time_step(rod, law) for rod in rods)
        stable = min(stable_time_step(body, law) for body in scene.bodies)
        if articulated:
            stable = min(stable, hinged_stable_time_step(scene.body, law, hinge_law(scene)))
        return stable

    def seconds_per_second(self, scene: Demand, time_step: float, activity: Activity) -> float:
        per_step = COST_PER_SPHERE_STEP * mean_spheres(scene) * scene.count
        if scene.mixture is not None and scene.mixture.flexible:
            per_step = (
                COST_PER_NODE_STEP * scene.mixture.mean([1.0 + size for size in scene.mixture.sizes]) * scene.count
            )
        return per_step / time_step * FACTORS.get(activity, 1.0)

    def seconds_to_compile(self, scene: Demand) -> float:
        return 0.0

    def build(self, scene: Demand, time_step: float) -> YadeEngine:
        return YadeEngine(
            particle=scene.model,
            cylinder=scene.cylinder,
            law=contact_law_of(scene),
            gravity=scene.gravity_m_per_s2,
            time_step=time_step,
            shaken=scene.calls_for(EffectName.CONTAINER_MOTION),
            hinge_law=hinge_law(scene, time_step) if scene.actuates else None,
            motor_law=motor_law_of(scene),
            track_work=scene.recording.energies,
            dissipation_interval=scene.recording.dissipation_interval_s,
            hooks=None if scene.hooks is None else scene.hooks.crosses,
            channel=scene.channel,
            strengths=scene.motor_strengths,
        )


def hinge_law(scene: Demand, time_step: float = 0.0) -> HingeLaw:
    """Return the law of the hinges of a scene with motors.

    Args:
        time_step: time step [s]; the dampers' relaxation time is not shorter than this, nor than `DAMPER_TIME`.
    """
    motor, pin = scene.motor, scene.fidelity.hinge_stiffness_N_per_m
    return HingeLaw(
        pin_stiffness=pin,
        # That of two pins of half the stiffness, at both faces of the links.
        tilt_stiffness=pin * (scene.smarticle.thickness_normal_m / 2) ** 2,
        shaft_stiffness=motor.stiffness_N_m_per_rad,
        torque_cap=scene.torque_limit if motor.law in ("slip", "servo") else None,
        shaft_damping=motor.damping_N_m_s_per_rad,
        damper_time=max(DAMPER_TIME, time_step),
    )
