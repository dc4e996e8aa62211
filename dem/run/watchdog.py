"""Stop a run whose result would have no meaning."""

import math
from dataclasses import dataclass

import numpy as np

from dem.arrays import Array, Flags
from dem.body.state import PileState
from dem.errors import RunError, reject
from dem.physics.overlaps import Extremes, Overlaps
from dem.setting.container import Cylinder

LOWER_STEP = "lower fidelity.time_step_fraction"
WARNED_FRACTION = 0.2  # of the limit `missed`, from which on a run warns at its end
BOTH_HOOKS = ("the lower hook", "the upper hook")


@dataclass(kw_only=True)
class Watchdog:
    """Limits that no body may exceed.

    Checks take the simulated time [s]. Beyond a limit they raise RunError with cause, smarticles, time and advice.
    """

    #: The container. A smarticle has escaped if a sphere's centre or a link's axis is beyond the wall or under the
    #: floor, or if its centre of mass is above the wall
    cylinder: Cylinder
    speed: float  #: Largest speed of a link's centre [m/s]; falls, shaking and motors of the scene cause lower speeds
    way_out: str = LOWER_STEP  #: Advice where a speed is larger
    floats: bool = False  #: Whether bodies are lighter than the liquid around them, so that they rise without end
    lifted: float = 0.0  #: Largest distance by which grips lift bodies, also above the wall [m]
    gap: float = math.inf  #: Largest gap of a hinge [m]; beyond it the hinge is broken
    depth: float = math.inf  #: Largest overlap [m]; beyond it contacts no longer keep bodies apart
    pressed: float = math.inf  #: Overlap [m] above which a run warns at its end: bodies stay apart, but are too soft
    energy: float = math.inf  #: Largest increase of the energy without work [J]; beyond it the simulation is unstable
    missed: float = math.inf  #: Largest residual of the energy ledger, over the dissipation [1]
    _ceiling: float = math.inf  # limit of kinetic and potential energy less the work done [J]

    def within_limits(self, extremes: Extremes, *, floor: float, raised: float | None = 0.0) -> bool:
        """Return whether the extremes over all bodies prove that all limits hold, except the limit of the energy.

        This test is quick but too strict. If the result is false, `check` and `check_depths` must decide.

        Args:
            floor: height of the floor [m].
            raised: None: the wall does not enclose the pile and is not checked. Any number: it is checked; the value
                matters only to `check`.
        """
        inside = extremes.lowest >= floor
        if raised is not None:
            cylinder = self.cylinder
            narrowest = min([cylinder.radius, *(radius for _, radius in cylinder.upper)])
            inside &= extremes.widest <= cylinder.corner_radius_of(narrowest)
            inside &= extremes.highest - floor < cylinder.height
        return inside and extremes.fastest <= self.speed and extremes.gap <= self.gap and extremes.deepest <= self.depth

    def check(
        self,
        state: PileState,
        *,
        floor: float,
        time: float,
        points: Array | None = None,
        raised: float | None = 0.0,
        gaps: Array | None = None,
    ) -> None:
        """Check speeds, hinges and positions of all smarticles; raise RunError beyond a limit.

        Args:
            floor: height of the floor [m].
            points: (N, P, 3) points that must be inside the container [m]: centres of the spheres, or points of the
                links' axes; None: centres of mass. The check of overlaps cannot replace this one, since YADE
                underestimates overlaps beyond wall or floor.
            raised: distance by which the upper hook may have lifted bodies since the start [m]; None: the wall does not
                enclose the pile, and only the floor bounds it.
            gaps: (N, k) distances between the links of each hinge or joint of a body [m]; None: none can open.
        """
        positions = state.positions
        speeds = state.speeds
        heights = positions[:, 2] - floor
        broken = ~(np.isfinite(positions).all(axis=1) & np.isfinite(speeds))
        reject(broken, time, "a position or velocity that is no number", LOWER_STEP)
        reject(
            speeds > self.speed,
            time,
            f"a speed above {self.speed:.3g} m/s (fastest {speeds.max(initial=0):.3g} m/s), "
            "which nothing in this scene explains",
            self.way_out,
        )
        if gaps is not None:
            # A gap that is NaN fails as well.
            reject(
                (~np.less_equal(gaps, self.gap)).any(axis=1),
                time,
                f"links more than {self.gap:.3g} m apart at a hinge (most {gaps.max(initial=0):.3g} m)",
                f"{LOWER_STEP}, or raise fidelity.hinge_stiffness_N_per_m (of chains particle.pin_stiffness_N_per_m)",
            )
        points = positions[:, None] if points is None else points
        above = points[..., 2] - floor
        outside: Flags = np.less(above, 0)
        out = np.zeros(len(positions), dtype=bool)
        if raised is not None:
            height = self.cylinder.height
            corners = self.cylinder.radii(above - raised) * (self.cylinder.corner_radius / self.cylinder.radius)
            beyond = (np.hypot(points[..., 0], points[..., 1]) > corners) & (above < height)
            # The wall's upper edge holds nothing: what leans over it is on its way out.
            out = (heights > height + max(raised, self.lifted)) | (beyond.any(axis=1) & (above > height).any(axis=1))
            outside |= beyond & ~out[:, None]
        reject(outside.any(axis=1), time, "left through the wall or the floor", "raise fidelity.stiffness_N_per_m")
        cause, way_out = "thrown out", "raise container.height_m, or shake or throw less"
        if self.floats:
            cause = "lighter than the liquid, which has no surface, and risen"
            way_out = "raise particle.density_kg_per_m3 above liquid.density_kg_per_m3, or end the run earlier"
        reject(out, time, f"{cause} over the wall of {self.cylinder.height:.3g} m", way_out)

    def check_depths(self, overlaps: Overlaps, *, time: float) -> None:
        """Check the overlaps of all contacts at a simulated time [s]; raise RunError beyond `depth`."""
        cause = (
            f"contacts more than {self.depth:.3g} m deep (deepest {overlaps.deepest:.3g} m), so that links pass "
            "through each other or through the container"
        )
        # Forces grow at least linearly with the overlap.
        factor = 2 * overlaps.deepest / self.depth
        way_out = f"raise fidelity.stiffness_N_per_m, about {factor:.2g} times, or load the pile less"
        if overlaps.held:
            # A higher stiffness does not help.
            first = overlaps.held[0]
            cause = (
                f"smarticle {first.smarticle} is held by {' and '.join(first.between)}, which have moved apart by "
                f"{first.apart:.3g} m: only its contacts can give way, the deepest by {overlaps.deepest:.3g} m"
            )
            way_out = (
                "set hooks.upper_height_m and lower_height_m further apart than w"
                if first.between == BOTH_HOOKS
                else "give the hook more room: a smaller hooks.length_m or a wider container"
            )
        reject(overlaps.deep, time, cause, way_out)

    def warn_of_depth(self, deepest: float, time: float) -> str | None:
        """Return a warning for the end of a run whose deepest contact [m] was at `time` [s], or None."""
        if not deepest > self.pressed:
            return None
        return (
            f"at t = {time:.4f} s contacts were {deepest:.3g} m deep, more than {self.pressed:.3g} m, half of a link's "
            "width: the pile is denser than one of bodies that keep their shape; raise fidelity.stiffness_N_per_m, at "
            f"least {2 * deepest / self.pressed:.2g} times, or load the pile less"
        )

    def check_energy(self, state: PileState, *, energy: float, elastic: float, time: float) -> None:
        """Check that the energy has not increased by more than work and springs can explain.

        E is the kinetic and potential energy, less all energy added and all work done since the start. Contacts, hinges
        and welding dissipate energy, and their springs return at most what they store. E can therefore exceed its value
        at an earlier check by at most the elastic energy at that check. RunError is raised if E exceeds the least of
        these sums by more than `self.energy`.

        Args:
            state: poses and velocities of the bodies, to name the fastest ones.
            energy: E [J]; NaN if the work is unknown at present, so that earlier checks no longer count.
            elastic: upper bound of the elastic energy of contacts and hinges [J].
        """
        if math.isnan(energy):
            self._ceiling = math.inf
            return
        rise = energy - self._ceiling
        if rise > self.energy:
            speeds = state.speeds
            reject(
                speeds >= speeds.max() / 2,
                time,
                f"an energy that has risen by {rise:.3g} J more than gravity, motors and springs explain (limit "
                f"{self.energy:.3g} J); these are the fastest, up to {speeds.max():.3g} m/s",
                LOWER_STEP,
            )
        self._ceiling = min(self._ceiling, energy + elastic)

    def check_residual(self, residual: float, *, dissipated: float, time: float) -> str | None:
        """Check the residual of the energy ledger; return a warning for the end of the run, or None.

        Args:
            residual: energy added and work done, less all energy stored and dissipated [J].
            dissipated: energy dissipated by contacts, hinges and welding since the start [J].
        """
        # A fraction of next to nothing has no meaning: the limit is at least that of an unexplained rise of the energy.
        limit = self.missed * dissipated + (self.energy if math.isfinite(self.energy) else 0.0)
        if not abs(residual) > WARNED_FRACTION * limit > 0.0:
            return None
        text = f"the energy ledger misses {residual:.3g} J, with {dissipated:.3g} J dissipated"
        if abs(residual) > limit:
            raise RunError(f"at t = {time:.4f} s {text} (limit {limit:.3g} J); {LOWER_STEP}")
        return f"{text}; {LOWER_STEP}"
