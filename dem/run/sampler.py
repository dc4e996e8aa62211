"""Compute the rows of the series from the engine, one row per sample."""

import math
from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dem.arrays import Array
from dem.body.chain import extent
from dem.body.state import LinkageState, PileState
from dem.engine.effect import EffectName
from dem.engine.interface import Engine, Filaments, JointReadings
from dem.plan.effects import ADDS
from dem.record.columns import COLUMNS, EVERY, GRIP_COLUMNS, STRAIN_COLUMNS, Columns
from dem.record.packing import packing_fraction

HINGE_ENERGY = "hinge_elastic_energy_J"
KEPT = ("before", "hooks", "plate", "grips", "grips_made", "strain", "strain_phase")  # keys of `Sampler.memory`


@dataclass
class Sampler:
    """Compute rows of the series, and keep values of the previous sample for means over time."""

    radius: float  #: Radius for packing fractions [m]; NaN: packing fractions have no meaning
    effects: Set[EffectName] = frozenset()  #: Effects of the scene
    memory: dict[str, Any] = field(default_factory=lambda: dict.fromkeys(KEPT))
    """Plain data of the previous sample. `before`: time [s], impulse of gravity [N s], momentum [kg m/s]; `hooks`,
    `plate`, `grips` and `strain`: number of steps, and forces summed over steps [N]; `grips_made`: number of grips;
    `strain_phase`: number of the phase that has tied the strings."""

    @property
    def described(self) -> Columns:
        """Descriptions of the columns that rows have, by name."""
        added = {name for effect in self.effects if effect in ADDS for name in ADDS[effect].series}
        if self.effects & {EffectName.FILAMENTS, EffectName.JOINTS}:
            added -= {HINGE_ENERGY}  # the elastic energies of these bodies have columns of their own
        return {name: column for name, column in EVERY.items() if name in COLUMNS or name in added}

    def sample(self, engine: Engine, state: PileState, phase: int) -> dict[str, Any]:
        """Return one row: a number, or a (2,) or (3,) array, by name of the column."""
        heights = state.positions[:, 2] - engine.boundaries.floor
        phi = packing_fraction(heights, solid_volume=state.volume, radius=self.radius)
        container_force = self._mean_force(engine, state.momentum)
        extra: dict[str, Any] = {}
        if EffectName.HOOKS in self.effects:
            lower, upper = self._mean_since("hooks", engine.steps, engine.boundaries.hook_sums)
            # The momentum balance includes the force on the hooks.
            container_force -= lower + upper
            extra |= {
                "hook_upper_force_N": upper,
                "hook_lower_force_N": lower,
                "hook_upper_z_m": engine.boundaries.upper_height,
            }
        if EffectName.PLATE in self.effects:
            (force,) = self._mean_since("plate", engine.steps, engine.boundaries.plate_sum[None])
            container_force -= force
            height = engine.boundaries.plate_height
            extra |= {"plate_force_N": force, "plate_z_m": math.nan if height is None else height}
        if EffectName.GRIPS in self.effects:
            grip_row, pull = self._grip_row(engine)
            extra |= grip_row
            # The momentum balance includes the grips, with the weight of what they hold.
            container_force -= np.nan_to_num(pull)
        if EffectName.WALL_REMOVAL in self.effects:
            outside = np.hypot(state.positions[:, 0], state.positions[:, 1]) > engine.cylinder.radius
            extra["outside_count"] = np.count_nonzero(outside)
            if not engine.boundaries.enclosed:
                phi = math.nan  # a pile that spreads fills no cylinder
        if EffectName.STRINGS in self.effects:
            extra |= self._strain_row(engine, state, phase)
            # The momentum balance includes the strings, whose forces act on the chain.
            pulls = extra["string_fixed_force_N"] + extra["string_pulled_force_N"]
            container_force += np.nan_to_num(pulls)
        row = {
            "time_s": engine.time,
            "phase": phase,
            "count": engine.count,
            "container_z_m": engine.boundaries.floor,
            "container_velocity_m_per_s": engine.boundaries.velocity,
            "container_force_N": container_force,
            "com_height_m": heights.mean() if len(heights) else math.nan,
            "kinetic_energy_J": state.kinetic_energy,
            "max_speed_m_per_s": np.linalg.norm(state.velocities, axis=1).max(initial=0.0),
            "unbalanced_force": engine.unbalanced_force(),
            "packing_fraction": phi,
        }
        if EffectName.MOTORS in self.effects:
            row |= _motor_row(engine, state)
        if engine.filaments is not None:
            joints = engine.filaments.joints
            row |= _filament_row(engine.filaments) if joints is None else _joint_row(engine.filaments, joints, state)
        if EffectName.ENERGIES in self.effects:
            row |= {
                "gravitational_energy_J": state.potential_energy(engine.gravity, 0.0),
                "container_work_J": engine.ledger.container_work,
            }
        if EffectName.ENERGY_ACCOUNT in self.effects:
            row |= _ledger_row(engine, row)
            if engine.filaments is not None:
                del row[HINGE_ENERGY]
        return row | extra

    def _mean_force(self, engine: Engine, momentum: Array) -> Array:
        # The container receives the momentum that smarticles lose, except for gravity and the throw of added
        # smarticles. This is exact over any interval; sampled contact forces would alias the shaking and miss impacts.
        time, impulse, previous = engine.time, engine.impulse, self.memory["before"]
        self.memory["before"] = [time, impulse, momentum.tolist()]
        if previous is None or time <= previous[0]:
            return np.full(3, math.nan)
        lost = np.array(previous[2]) - momentum - np.array([0.0, 0.0, impulse - previous[1]])
        return np.asarray(lost / (time - previous[0]))

    def _mean_since(self, name: str, steps: int, sums: Array) -> Array:
        """Return forces [N], averaged over the steps since the previous sample; NaN for the first sample.

        `sums` are forces summed over all `steps` since the start [N]; `name` is the key of the previous sums in
        `memory`.
        """
        previous = self.memory[name]
        self.memory[name] = [steps, sums.tolist()]
        if previous is None or steps <= previous[0]:
            return np.full_like(sums, math.nan)
        return np.asarray((sums - np.array(previous[1])) / (steps - previous[0]))

    def _grip_row(self, engine: Engine) -> tuple[dict[str, Any], Array]:
        """Return columns about grips, and the force [N] on all of them together; NaN where it is unknown."""
        grips, none = engine.grips, np.full(3, math.nan)
        row: dict[str, Any] = dict.fromkeys(GRIP_COLUMNS, math.nan)
        row |= {"grip_fixed_force_N": none, "grip_moved_force_N": none, "grip_fixed_count": 0, "grip_moved_count": 0}
        if grips is None or not len(grips.counts):
            self.memory["grips"] = [engine.steps, None]
            return row, none
        previous = self.memory["grips"]
        if previous is not None and self.memory["grips_made"] != grips.made:  # sums begin anew
            self.memory.update(grips=[previous[0], np.zeros((2, len(grips.counts), 3)).tolist()])
        self.memory["grips_made"] = grips.made
        # The last grip moves; the one before it rests, if there is one.
        moved, sums = grips.moved, np.stack([grips.sums, grips.pushed])
        pulls, forces = self._mean_since("grips", engine.steps, sums)
        pull = pulls.sum(axis=0)
        row |= {"grip_moved_force_N": forces[-1], "grip_moved_count": grips.counts[-1]}
        row["grip_moved_weight_N"] = grips.weights[-1]
        if len(forces) == 1:
            return row | {"grip_fixed_force_N": np.zeros(3), "elongation_m": math.hypot(*moved[0])}, pull
        row |= {"grip_fixed_force_N": forces[-2], "grip_fixed_count": grips.counts[-2]}
        row["elongation_m"] = math.hypot(*(moved[-1] - moved[-2]))
        return row | {"grip_distance_m": math.dist(*grips.places[-2:])}, pull

    def _strain_row(self, engine: Engine, state: PileState, phase: int) -> dict[str, Any]:
        strings, none = engine.strings, np.full(3, math.nan)
        row: dict[str, Any] = dict.fromkeys(STRAIN_COLUMNS, math.nan)
        row |= {name: none for name in STRAIN_COLUMNS if name.endswith("_force_N")}
        if engine.count:
            row["chain_width_m"] = extent(state.smarticles, 2 * engine.particle.radius)
        walls = engine.boundaries.channel_sums
        ends = [strings.sums if strings.tied else np.zeros((2, 3)), walls if len(walls) else np.zeros((2, 3))]
        sums = np.concatenate(ends)
        if not strings.tied:
            self.memory.update(strain=[engine.steps, sums.tolist()], strain_phase=None)
            return row
        previous = self.memory["strain"]
        if previous is not None and self.memory.get("strain_phase") != phase:
            # Strings that are tied anew begin at 0; walls do not.
            self.memory["strain"] = [previous[0], [*np.zeros((2, 3)).tolist(), *previous[1][2:]]]
        self.memory["strain_phase"] = phase
        row["pulled_m"] = strings.pulled
        row["chain_length_m"] = float(np.ptp(strings.ties[:, 0]))
        means = self._mean_since("strain", engine.steps, sums)
        return row | dict(zip(list(STRAIN_COLUMNS)[:4], means, strict=True))


def _motor_row(engine: Engine, state: PileState) -> dict[str, Any]:
    motors = engine.motors.readings
    actual = state.smarticles.angles
    angles = _mean(actual)
    if motors is None or not engine.motors.articulated:
        held = angles if motors is None else _mean(motors.commands)
        behind = error = torque = halted = math.nan
    else:
        held = _mean(motors.commands)
        behind = np.abs(motors.schedule - motors.commands).max(initial=0.0)
        error = np.abs(motors.commands - actual).max(initial=0.0)
        torque = math.sqrt(np.square(motors.torques).mean())
        halted = motors.halted.mean()
    return {
        "commanded_angle_rad": held,
        "angle_rad": angles,
        "schedule_error_rad": behind,
        "tracking_error_rad": error,
        "motor_torque_N_m": torque,
        "halted_fraction": halted,
        "motor_work_J": 0.0 if motors is None else motors.work.sum(),
        "joint_gap_m": engine.motors.gaps().max(initial=0.0),
    }


def _filament_row(filaments: Filaments) -> dict[str, Any]:
    energies = filaments.energies
    return {
        "stretching_energy_J": energies.stretching,
        "bending_energy_J": energies.bending,
        "twisting_energy_J": energies.twisting,
        "active_work_J": energies.active,
        "grip_work_J": energies.gripped,
        "drag_loss_J": energies.dragged,
        "grip_force_N": filaments.force(),
        "gripped_count": filaments.held,
    }


def _joint_row(linkages: Filaments, joints: JointReadings, state: PileState) -> dict[str, Any]:
    assert isinstance(state, LinkageState)
    energies = linkages.energies
    return {
        "joint_energy_J": energies.bending,
        "pin_energy_J": energies.stretching + energies.twisting,
        "pin_gap_m": state.gaps.max(initial=0.0),
        "joint_motor_torque_N_m": joints.motor_torque,
        "joint_motor_work_J": energies.active,
        "broken_joints": joints.broken,
        "held_work_J": energies.gripped,
        "held_force_N": linkages.force(),
        "held_count": linkages.held,
    }


def _ledger_row(engine: Engine, row: Mapping[str, Any]) -> dict[str, Any]:
    contacts, hinges = engine.ledger.elastic()
    given = engine.ledger.added + row.get("motor_work_J", 0.0) + row["container_work_J"]
    given += row.get("active_work_J", 0.0) + row.get("joint_motor_work_J", 0.0)
    stored = row["kinetic_energy_J"] + row["gravitational_energy_J"] + contacts + hinges
    return {
        "added_energy_J": engine.ledger.added,
        "contact_elastic_energy_J": contacts,
        HINGE_ENERGY: hinges,
        "dissipated_energy_J": engine.ledger.dissipated,
        "energy_residual_J": given - stored - engine.ledger.dissipated,
    }


def _mean(angles: Array) -> Array:
    """Return the mean (2,) over smarticles of angles (N, 2); NaN without smarticles."""
    return np.asarray(angles.mean(axis=0)) if len(angles) else np.full(2, math.nan)
