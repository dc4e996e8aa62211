"""What is recorded: datasets of `series.h5` and cell data of frames, with unit and description, as effects add them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Column(NamedTuple):
    """One dataset, or one field of the frames.

    Attributes:
        unit: SI; "1" for a pure number.
        label: What tables call it, without the unit.
        description: What it is, in a few words.
    """

    unit: str
    label: str
    description: str


Columns = Mapping[str, Column]
"""Datasets by name, in the order of the file."""

# In every scene.
COLUMNS: Columns = {
    "time_s": Column("s", "time", "simulated time"),
    "phase": Column("1", "phase", "index of the phase in the scene"),
    "count": Column("1", "count", "smarticles in the container"),
    "container_z_m": Column("m", "container z", "height of the container's floor"),
    "container_velocity_m_per_s": Column("m/s", "container velocity", "vertical velocity of the container"),
    "container_force_N": Column(
        "N",
        "container force",
        "force of the smarticles on the container (x, y, z), mean since the sample before, from the momentum balance",
    ),
    "com_height_m": Column("m", "com height", "mean height of the centres of mass above the floor"),
    "kinetic_energy_J": Column("J", "kinetic energy", "translational and rotational kinetic energy of the smarticles"),
    "max_speed_m_per_s": Column("m/s", "max speed", "largest speed of a centre of mass"),
    "unbalanced_force": Column("1", "unbalanced force", "mean net force on a smarticle over its weight"),
    "packing_fraction": Column(
        "1",
        "packing fraction",
        "N V_s / (pi r² z), z the second-highest centre of mass above the floor; NaN in a mould of tiers and once the "
        "container is taken away",
    ),
}
# Only in scenes that actuate.
MOTOR_COLUMNS: Columns = {
    "commanded_angle_rad": Column("rad", "commanded angle", "mean angle that the motors hold, barb 1 and barb 2"),
    "angle_rad": Column("rad", "angle", "mean actual angle, barb 1 and barb 2"),
    "schedule_error_rad": Column(
        "rad",
        "schedule error",
        "largest difference of the angle of the schedule and the commanded one; NaN while welded",
    ),
    "tracking_error_rad": Column(
        "rad", "tracking error", "largest difference of commanded and actual angle; NaN while welded"
    ),
    "motor_torque_N_m": Column("N m", "motor torque", "root mean square torque of the motors; NaN while welded"),
    "halted_fraction": Column(
        "1", "halted fraction", "share of motors that are halted by their torque; NaN while welded"
    ),
    "motor_work_J": Column("J", "motor work", "work of all motors on the links since the start, sum of ∫ τ dα"),
    "joint_gap_m": Column("m", "joint gap", "how far the hinge that gives way most has done so"),
}
# Only in scenes that ask for energy.
ENERGY_COLUMNS: Columns = {
    "gravitational_energy_J": Column(
        "J", "gravitational energy", "of all smarticles above the floor's height at the start"
    ),
    "container_work_J": Column(
        "J",
        "container work",
        "work of the moving container, hook or strings on the smarticles since the start, without their own weight",
    ),
}
# Only in scenes that sample dissipation. Tables have always called these by the dataset's own name.
LEDGER_COLUMNS: Columns = {
    "added_energy_J": Column(
        "J", "added_energy_J", "gravitational energy that smarticles had when they were poured, above the same height"
    ),
    "contact_elastic_energy_J": Column("J", "contact_elastic_energy_J", "in the springs of all contacts"),
    "hinge_elastic_energy_J": Column("J", "hinge_elastic_energy_J", "in the pins and dampers of all hinges"),
    "dissipated_energy_J": Column(
        "J", "dissipated_energy_J", "by contacts, hinges and welding since the start, sampled"
    ),
    "energy_residual_J": Column(
        "J", "energy_residual_J", "added energy and work less everything stored and dissipated: the ledger's error"
    ),
}
# Only in scenes with hooks.
HOOK_COLUMNS: Columns = {
    "hook_upper_force_N": Column(
        "N", "upper hook force", "force of the smarticles on the upper hook (x, y, z), mean since the sample before"
    ),
    "hook_lower_force_N": Column(
        "N", "lower hook force", "force of the smarticles on the lower hook (x, y, z), mean since the sample before"
    ),
    "hook_upper_z_m": Column("m", "upper hook z", "height of the upper hook's centre"),
}
# Only in scenes that take the container away.
RELEASE_COLUMNS: Columns = {
    "outside_count": Column(
        "1", "outside_count", "smarticles whose centre of mass is farther from the axis than the container's radius"
    ),
}
# Only in scenes that strain a chain. Forces are means since the sample before, and NaN while no string is tied.
STRAIN_COLUMNS: Columns = {
    "string_fixed_force_N": Column(
        "N", "fixed string force", "force of the string that is held on the chain (x, y, z)"
    ),
    "string_pulled_force_N": Column(
        "N", "pulled string force", "force of the string that is pulled on the chain (x, y, z)"
    ),
    "channel_lower_force_N": Column(
        "N", "lower wall force", "force of the chain on the wall at lower y (x, y, z); 0 without walls"
    ),
    "channel_upper_force_N": Column(
        "N", "upper wall force", "force of the chain on the wall at higher y (x, y, z); 0 without walls"
    ),
    "pulled_m": Column("m", "pulled", "how far the moved end of the string has gone"),
    "chain_length_m": Column("m", "chain length", "distance along x of the two points where strings are tied"),
    "chain_width_m": Column("m", "chain width", "extent of all links along y, with their thickness"),
}

EVERY: Columns = {
    **COLUMNS,
    **MOTOR_COLUMNS,
    **ENERGY_COLUMNS,
    **LEDGER_COLUMNS,
    **HOOK_COLUMNS,
    **RELEASE_COLUMNS,
    **STRAIN_COLUMNS,
}
"""All that any scene may have."""

# Cell data of the frames: one value per link, in the order barb 1, middle link, barb 2 of each smarticle.
FIELDS: Columns = {
    "smarticle_id": Column("1", "smarticle", "number of the smarticle, the same in all frames"),
    "link": Column("1", "link", "0 barb 1, 1 middle link, 2 barb 2"),
    "velocity_m_per_s": Column("m/s", "velocity", "of the link's centre (x, y, z)"),
    "angular_velocity_rad_per_s": Column("rad/s", "angular velocity", "of the link (x, y, z)"),
    "contacts": Column("1", "contacts", "how many other smarticles this smarticle touches, by the engine"),
    "time_s": Column("s", "time", "simulated time, the same for all links, so that each file stands alone"),
    "floor_z_m": Column("m", "floor z", "height of the container's floor, likewise; heights are measured from it"),
    "phase": Column("1", "phase", "index of the phase in the scene, likewise"),
}
# Of the files of forces, one value per contact; only with `recording.contact_forces`.
FORCE_FIELDS: Columns = {
    "first_smarticle": Column("1", "first", "number of the one that the force acts on"),
    "first_link": Column("1", "first link", "0 barb 1, 1 middle link, 2 barb 2"),
    "second_smarticle": Column("1", "second", "number of the one that exerts it, the higher one; -1 for a boundary"),
    "second_link": Column("1", "second link", "likewise; -1 for a boundary"),
    "fixture": Column(
        "1", "fixture", "-1 none, 0 floor, 1 wall, 2 lower hook, 3 upper hook, 4 and 5 the channel's walls"
    ),
    "normal_force_N": Column("N", "normal force", "sum of those at the points of contact; above 0"),
    "tangential_force_N": Column("N", "tangential force", "size of the sum of those at the points of contact"),
    "force_N": Column("N", "force", "on the first one (x, y, z), all points of contact together"),
    "point_m": Column("m", "point", "where it acts (x, y, z), mean of the points, weighted by their normal forces"),
    "time_s": Column("s", "time", "simulated time, the same for all contacts"),
    "phase": Column("1", "phase", "index of the phase in the scene, likewise"),
}
# Only in scenes that actuate.
MOTOR_FIELDS: Columns = {
    "angle_rad": Column("rad", "angle", "of a barb, 0 straight, pi/2 the U; NaN on middle links"),
    "motor_torque_N_m": Column(
        "N m", "motor torque", "of the motor at the barb's hinge; NaN on middle links and while welded"
    ),
    "motor_work_J": Column("J", "motor work", "of that motor since the start; NaN on middle links and while welded"),
    "halted": Column("1", "halted", "1 where that motor is halted by its torque, else 0"),
}
