"""Have an engine compile all code that a scene needs, without simulating the scene."""

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.chain import Tie
from dem.body.placement import Poses
from dem.engine.interface import Engine
from dem.engine.kinds import engine_kind
from dem.physics.contact import StringLaw
from dem.plan.steps import time_steps
from dem.scene.scene import Scene

APART = 1.0  # m; distance of smarticles, which touch nothing: code is compiled whether there are contacts or not


def compile_for(scene: Scene) -> None:
    """Compile all code for a scene, by making time steps and queries of the engine in a test set-up.

    The scene's number of bodies are put far apart. Steps are made with rigid bodies, with motors and strings if the
    scene has them, and with the wall lifted if a phase does so.
    """
    engine = engine_kind(scene.engine).build(scene, min(time_steps(scene)))
    places = np.zeros((scene.count, 3))
    places[:, 0 if scene.plane is not None else 2] = APART * (1 + np.arange(scene.count))
    kinds = None if scene.mixture is None else scene.mixture.of
    engine.add(Poses(places, (Rotation.identity(),) * scene.count, kinds))
    # A chain is pulled from the start on.
    if not scene.pulled_by:
        _step_and_query(engine)
    if scene.actuates:
        engine.motors.articulate()
        engine.motors.actuate(np.zeros((1, scene.count, 2)), scene.fidelity.control_interval_s)
        if scene.pulled_by:
            ends = [Tie(0, 0, 0.0), Tie(scene.count - 1, 2, 0.0)]
            engine.strings.tie(ends, StringLaw(length=APART, stiffness=1.0, damping=0.0), (0.0, 0.0))
        _step_and_query(engine)
        if scene.pulled_by:
            engine.strings.untie()
        engine.motors.weld()
    if any(phase.frees and phase.pushing_speed(scene.gravity_m_per_s2) for phase in scene.phases):
        engine.boundaries.lift_wall(0.0)
        _step_and_query(engine)


def _step_and_query(engine: Engine) -> None:
    engine.advance(1)
    engine.extremes(engine.state())
    engine.overlaps(APART)
    engine.contact_forces()
    assert np.isfinite(engine.motors.work)
