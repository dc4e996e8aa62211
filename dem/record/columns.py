"""The datasets of `series.h5` with unit and description, set by set as effects add them."""

from __future__ import annotations

# In every scene.
COLUMNS: dict[str, tuple[str, str]] = {
    "time_s": ("s", "simulated time"),
    "phase": ("1", "index of the phase in the scene"),
    "count": ("1", "smarticles in the container"),
    "container_z_m": ("m", "height of the container's floor"),
    "container_velocity_m_per_s": ("m/s", "vertical velocity of the container"),
    "container_force_N": (
        "N",
        "force of the smarticles on the container (x, y, z), mean since the sample before, from the momentum balance",
    ),
    "com_height_m": ("m", "mean height of the centres of mass above the floor"),
    "kinetic_energy_J": ("J", "translational and rotational kinetic energy of the smarticles"),
    "max_speed_m_per_s": ("m/s", "largest speed of a centre of mass"),
    "unbalanced_force": ("1", "mean net force on a smarticle over its weight"),
    "packing_fraction": (
        "1",
        "N V_s / (pi r² z), z the second-highest centre of mass above the floor; NaN in a mould of tiers and once the "
        "container is taken away",
    ),
}

# Only in scenes that actuate.
MOTOR_COLUMNS: dict[str, tuple[str, str]] = {
    "commanded_angle_rad": ("rad", "mean angle that the motors hold, barb 1 and barb 2"),
    "angle_rad": ("rad", "mean actual angle, barb 1 and barb 2"),
    "schedule_error_rad": (
        "rad",
        "largest difference of the angle of the schedule and the commanded one; NaN while welded",
    ),
    "tracking_error_rad": ("rad", "largest difference of commanded and actual angle; NaN while welded"),
    "motor_torque_N_m": ("N m", "root mean square torque of the motors; NaN while welded"),
    "halted_fraction": ("1", "share of motors that are halted by their torque; NaN while welded"),
    "motor_work_J": ("J", "work of all motors on the links since the start, sum of ∫ τ dα"),
    "joint_gap_m": ("m", "how far the hinge that gives way most has done so"),
}
# Only in scenes that ask for energy.
ENERGY_COLUMNS: dict[str, tuple[str, str]] = {
    "gravitational_energy_J": ("J", "of all smarticles above the floor's height at the start"),
    "container_work_J": (
        "J",
        "work of the moving container, hook or strings on the smarticles since the start, without their own weight",
    ),
}

# Only in scenes that sample dissipation.
LEDGER_COLUMNS: dict[str, tuple[str, str]] = {
    "added_energy_J": ("J", "gravitational energy that smarticles had when they were poured, above the same height"),
    "contact_elastic_energy_J": ("J", "in the springs of all contacts"),
    "hinge_elastic_energy_J": ("J", "in the pins and dampers of all hinges"),
    "dissipated_energy_J": ("J", "by contacts, hinges and welding since the start, sampled"),
    "energy_residual_J": ("J", "added energy and work less everything stored and dissipated: the account's error"),
}

# Only in scenes with hooks.
HOOK_COLUMNS: dict[str, tuple[str, str]] = {
    "hook_upper_force_N": ("N", "force of the smarticles on the upper hook (x, y, z), mean since the sample before"),
    "hook_lower_force_N": ("N", "force of the smarticles on the lower hook (x, y, z), mean since the sample before"),
    "hook_upper_z_m": ("m", "height of the upper hook's centre"),
}
# Only in scenes that take the container away.
RELEASE_COLUMNS: dict[str, tuple[str, str]] = {
    "outside_count": ("1", "smarticles whose centre of mass is farther from the axis than the container's radius"),
}
# Only in scenes that strain a chain. Forces are means since the sample before, and NaN while no string is tied.
STRAIN_COLUMNS: dict[str, tuple[str, str]] = {
    "string_fixed_force_N": ("N", "force of the string that is held on the chain (x, y, z)"),
    "string_pulled_force_N": ("N", "force of the string that is pulled on the chain (x, y, z)"),
    "channel_lower_force_N": ("N", "force of the chain on the wall at lower y (x, y, z); 0 without walls"),
    "channel_upper_force_N": ("N", "force of the chain on the wall at higher y (x, y, z); 0 without walls"),
    "pulled_m": ("m", "how far the moved end of the string has gone"),
    "chain_length_m": ("m", "distance along x of the two points where strings are tied"),
    "chain_width_m": ("m", "extent of all links along y, with their thickness"),
}
