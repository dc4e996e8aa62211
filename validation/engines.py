"""Test access to an engine's internals: what a case needs beyond a run, such as pushing or holding a body."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from dem.body.particle import Particle
from dem.engine.interface import Engine
from dem.physics.contact import ContactLaw
from dem.scene.scene import Scene

Array = NDArray[np.float64]

# The ball of all cases: steel. The stiffness is that of the fidelities `standard` and `reference`.
BALL_RADIUS, BALL_MASS = 2e-3, 2.6e-4  # m, kg
STIFFNESS = 500.0  # N/m


class EngineAccess(Protocol):
    """EngineAccess on one engine. They have no state of their own: processes send them to each other.

    Velocities belong to the half step before the positions (leapfrog) on both engines: a body that is to have v at
    t = 0 under an acceleration a is pushed to v − a dt/2.
    """

    @property
    def name(self) -> str:
        """The engine, as scenes call it."""

    # -- what is simulated -------------------------------------------------------------------------------------

    def ball(self) -> Particle:
        """What meets the floor like a ball of BALL_MASS, at the lever BALL_RADIUS, at `ball_turn`."""

    @property
    def ball_turn(self) -> Rotation:
        """How `ball` is held so that one point of it is lowest, and meets another one end to end along z."""

    def roller(self) -> Particle:
        """What rolls along y like a solid ball of BALL_RADIUS and BALL_MASS, not turned."""

    def ends(self, particle: Particle) -> Array:
        """(n, 3) centres of all spheres that the floor may touch [m], body frame."""

    def swept(self, particle: Particle) -> Array:
        """(n, 3) centres of spheres that are as good as the whole smarticle [m], body frame."""

    @property
    def arm_share(self) -> float:
        """Where in an overlap with the floor its force acts [1]: 0 at the surface of the body, 1 at the floor."""

    def pin_stiffness(self, scene: Scene) -> float:
        """Stiffness of a hinge against parting [N/m]; inf where it cannot."""

    def spring_shafts(self) -> dict[str, Any]:
        """Keys of `motor` in a scene file whose motors have springs for shafts."""

    # -- simulations -------------------------------------------------------------------------------------------

    def build(self, particle: Particle, law: ContactLaw, *, dt: float, gravity: float = 0.0) -> Engine:
        """Build an engine with a floor at z = 0 and a wall far away."""

    def build_hinged(self, scene: Scene, *, gravity: float, dt: float | None = None) -> Engine:
        """Build the same for smarticles that are articulated, at the time step of the scene."""

    # -- actions ---------------------------------------------------------------------------------------------

    def push(self, engine: Engine, k: int, velocity: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> None:
        """Give a welded smarticle a velocity [m/s] and a spin [rad/s]."""

    def force(self, engine: Engine, k: int, link: int, force: ArrayLike) -> None:
        """Let a force [N] act on the centre of a link from now on."""

    def hold(self, engine: Engine) -> None:
        """Hold the middle link of smarticle 0, articulated and at rest, where it is."""

    def swing(self, engine: Engine, links: Iterable[tuple[float, float, float]]) -> None:
        """Set the links of smarticle 0, articulated and not turned, in motion in their plane.

        Args:
            engine: the simulation.
            links: velocities along x and y [m/s] and spin about z [rad/s] of barb 1, middle link, barb 2; such as
                hinges allow.
        """

    def burden(self, engine: Engine, k: int, ratio: float, *, rise: float) -> None:
        """Make a smarticle `ratio` times as heavy [1]; gravity acts.

        Args:
            engine: the simulation.
            k: the smarticle.
            ratio: [1].
            rise: time within which its weight grows where its inertia does not [s].
        """

    # -- what is felt ------------------------------------------------------------------------------------------

    def floor_force(self, engine: Engine) -> Array:
        """(3,) force of the smarticles on floor and wall in the last step [N]."""

    def torques(self, engine: Engine) -> Array:
        """(2,) what the motors of smarticle 0 exert [N m]."""

    # -- what no simulation survives ---------------------------------------------------------------------------

    def spoil(self, engine: Engine, what: str) -> None:
        """Spoil the second smarticle, or its last link: see `validation.hard.broken`."""

    def heat(self, engine: Engine, share: float) -> None:
        """Let all dashpots drive by a share [1] of what they damped."""


ENGINES = ("yade", "links")


def engine_access(engine: str) -> EngineAccess:
    """Return test access to an engine, by its name."""
    # Imported when asked for: links need no YADE.
    if engine == "yade":
        from validation.yade_access import YadeAccess  # noqa: PLC0415

        return YadeAccess()
    from validation.links_access import LinksAccess  # noqa: PLC0415

    return LinksAccess()
