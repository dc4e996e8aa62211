"""Recorded quantities with units and descriptions, in `series.h5` and the cell data of VTK files."""

from collections.abc import Mapping
from typing import NamedTuple

from dem.strict import unit_of


class Column(NamedTuple):
    """One dataset of the series, or one field of the frames."""

    unit: str  #: Unit of the SI; "1" for a pure number
    label: str  #: Name in tables, without the unit
    description: str

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of a vector, which the description states; one empty name for a number."""
        return next((COMPONENTS[number] for text, number in _VECTORS.items() if text in self.description), ("",))


#: Names of the components of a vector, by their number
COMPONENTS = {2: ("barb 1", "barb 2"), 3: ("x", "y", "z")}
_VECTORS = {"barb 1 and barb 2": 2, "(x, y, z)": 3}  # what descriptions of vectors state

Columns = Mapping[str, Column]  #: Datasets by name, in the order of the file


def _columns(*, whole_names: bool = False, **described: str | tuple[str, str]) -> Columns:
    """Return columns by name, each with the unit that ends its name: `speed_m_per_s` has m/s.

    Each column is described, or has a pair (label, description). Without a label of its own it is labelled by its name
    without the unit, with blanks for underscores; with `whole_names` by its whole name.
    """
    found = {}
    for name, text in described.items():
        own_label, unit = unit_of(name)
        own_label = name if whole_names else own_label.replace("_", " ")
        label, description = (own_label, text) if isinstance(text, str) else text
        found[name] = Column(unit or "1", label, description)
    return found


# In every scene.
COLUMNS = _columns(
    time_s="simulated time",
    phase="index of the phase in the scene",
    count="smarticles in the container",
    container_z_m="height of the container's floor",
    container_velocity_m_per_s="vertical velocity of the container",
    container_force_N="force of the smarticles on the container (x, y, z), mean since the sample before, from "
    "the momentum balance",
    com_height_m="mean height of the centres of mass above the floor",
    kinetic_energy_J="translational and rotational kinetic energy of the smarticles",
    max_speed_m_per_s="largest speed of a centre of mass",
    unbalanced_force="mean net force on a smarticle over its weight",
    packing_fraction="N V_s / (pi r² z), z the second-highest centre of mass above the floor; NaN in a mould of "
    "tiers and once the container is taken away",
)
# In scenes that actuate.
MOTOR_COLUMNS = _columns(
    commanded_angle_rad="mean angle that the motors hold, barb 1 and barb 2",
    angle_rad="mean actual angle, barb 1 and barb 2",
    schedule_error_rad="largest difference between the schedule's and the commanded angle; NaN while welded",
    tracking_error_rad="largest difference between commanded and actual angle; NaN while welded",
    motor_torque_N_m="root mean square torque of the motors; NaN while welded",
    halted_fraction="fraction of motors that are halted by their torque; NaN while welded",
    motor_work_J="work of all motors on the links since the start, sum of ∫ τ dα",
    joint_gap_m="largest gap between the two links of a hinge",
)
# In scenes that ask for energy.
ENERGY_COLUMNS = _columns(
    gravitational_energy_J="gravitational energy of all smarticles, zero at the floor's height at the start",
    container_work_J="work of the moving container, plate, hook, grips or strings on the smarticles since the "
    "start, without the weight of hook and container",
)
# In scenes that sample dissipation.
LEDGER_COLUMNS = _columns(
    whole_names=True,
    added_energy_J="energy of smarticles when they were added, zero at the floor's height at the start",
    contact_elastic_energy_J="energy in the springs of all contacts",
    hinge_elastic_energy_J="energy in the pins and dampers of all hinges; not recorded for filaments and chains",
    dissipated_energy_J="energy dissipated by contacts, hinges and welding since the start, sampled",
    energy_residual_J="added energy and work less all energy stored and dissipated: the ledger's error",
)
# In scenes with hooks.
HOOK_COLUMNS = _columns(
    hook_upper_force_N=(
        "upper hook force",
        "force of the smarticles on the upper hook (x, y, z), mean since the sample before",
    ),
    hook_lower_force_N=(
        "lower hook force",
        "force of the smarticles on the lower hook (x, y, z), mean since the sample before",
    ),
    hook_upper_z_m=("upper hook z", "height of the upper hook's centre"),
)
# In scenes that compress the pile. Forces are means since the sample before.
PLATE_COLUMNS = _columns(
    plate_force_N="force of the smarticles on the plate (x, y, z), mean since the sample before",
    plate_z_m="height of the plate's lower face; NaN while there is no plate",
)
# In scenes with grips of rigid bodies.
GRIP_COLUMNS = _columns(
    grip_fixed_force_N="force of other smarticles, floor and wall on what the grip that rests holds (x, y, z), "
    "mean since the sample before; NaN while nothing is gripped",
    grip_moved_force_N="force of other smarticles, floor and wall on what the grip that moves holds (x, y, z), "
    "mean since the sample before; NaN while nothing is gripped",
    elongation_m="way of the grip that moves, against the one that rests; NaN while nothing is gripped",
    grip_distance_m="distance between the means of the centres of mass of what both grips hold; NaN without two grips",
    grip_fixed_count="smarticles that the grip that rests holds",
    grip_moved_count="smarticles that the grip that moves holds",
    grip_moved_weight_N="weight of the smarticles that the grip that moves holds; NaN while nothing is gripped",
)
# In scenes that take the container away.
RELEASE_COLUMNS = _columns(
    whole_names=True,
    outside_count="smarticles whose centre of mass is farther from the axis than the container's radius",
)
# In scenes that strain a chain. Forces are means since the sample before, and NaN while no string is tied.
STRAIN_COLUMNS = _columns(
    string_fixed_force_N=("fixed string force", "force of the string that is held on the chain (x, y, z)"),
    string_pulled_force_N=("pulled string force", "force of the string that is pulled on the chain (x, y, z)"),
    channel_lower_force_N=("lower wall force", "force of the chain on the wall at lower y (x, y, z); 0 without walls"),
    channel_upper_force_N=("upper wall force", "force of the chain on the wall at higher y (x, y, z); 0 without walls"),
    pulled_m="distance by which the moving end of a string has moved",
    chain_length_m="distance along x between the two points where strings are tied",
    chain_width_m="extent of all links along y, with their thickness",
)
# In scenes with filaments.
FILAMENT_COLUMNS = _columns(
    stretching_energy_J="energy of stretched filaments",
    bending_energy_J="energy of filaments bent away from the curvature that they prefer",
    twisting_energy_J="energy of twisted filaments",
    active_work_J="work of filaments that bend by themselves, since the start",
    grip_work_J="work of grips on filaments since the start; container_work_J has it, too",
    drag_loss_J="energy taken by the liquid's drag since the start; dissipated_energy_J has it, too",
    grip_force_N="force of all grips on the filaments (x, y, z), in the last step",
    gripped_count="filaments that a grip holds",
)
# In scenes with chains of links.
JOINT_COLUMNS = _columns(
    joint_energy_J="energy of elastic joints",
    pin_energy_J="energy of the springs that keep joints together",
    pin_gap_m="widest gap between ends of links at a joint",
    joint_motor_torque_N_m="greatest torque of a joint's motor, in the last step",
    joint_motor_work_J="work of the motors of joints, since the start",
    broken_joints="joints that are broken",
    held_work_J="work of grips on chains since the start; container_work_J has it, too",
    held_force_N="force of all grips on the chains (x, y, z), in the last step",
    held_count="chains that a grip holds",
)
EVERY: Columns = {
    **{**COLUMNS, **MOTOR_COLUMNS, **ENERGY_COLUMNS, **LEDGER_COLUMNS},
    **{**HOOK_COLUMNS, **PLATE_COLUMNS, **GRIP_COLUMNS, **RELEASE_COLUMNS, **STRAIN_COLUMNS},
    **{**FILAMENT_COLUMNS, **JOINT_COLUMNS},
}
"""Columns of all scenes together."""

# Cell data of the frames: one value per link, in the order barb 1, middle link, barb 2 of each smarticle.
FIELDS = _columns(
    smarticle_id=("smarticle", "number of the smarticle in all frames"),
    link="0 barb 1, 1 middle link, 2 barb 2",
    velocity_m_per_s="velocity of the link's centre (x, y, z)",
    angular_velocity_rad_per_s="angular velocity of the link (x, y, z)",
    contacts="number of other smarticles that this smarticle touches, by the engine",
    time_s="simulated time, equal for all links, so that each file stands alone",
    floor_z_m="height of the container's floor, equal for all links; heights are measured from it",
    phase="index of the phase in the scene, equal for all links",
)
# More cell data of frames in scenes with other bodies than smarticles, whose links are bars.
BODY_FIELDS = _columns(
    kind="kind of the body, a place in the list `kinds` of run.json",
    normal="unit vector along the normal of a flat section (x, y, z); 0 where the section is round",
)
# Cell data of the files of forces: one value per contact; with `recording.contact_forces`.
FORCE_FIELDS = _columns(
    first_smarticle=("first", "number of the smarticle on which the force acts"),
    first_link="link on which the force acts: 0 barb 1, 1 middle link, 2 barb 2",
    second_smarticle=("second", "number of the smarticle that exerts the force, the higher one; -1 for a boundary"),
    second_link="link that exerts the force: 0 barb 1, 1 middle link, 2 barb 2; -1 for a boundary",
    fixture="boundary that exerts the force: 0 floor, 1 wall, 2 lower hook, 3 upper hook, 4 and 5 the channel's walls, "
    "6 plate; -1 between smarticles",
    normal_force_N="sum of the normal forces at the points of contact, above 0",
    tangential_force_N="magnitude of the sum of the tangential forces at the points of contact",
    force_N="total force on the first smarticle (x, y, z), summed over the points of contact",
    point_m="mean of the points of contact (x, y, z), weighted by their normal forces",
    time_s="simulated time, equal for all contacts",
    phase="index of the phase in the scene, equal for all contacts",
)
# Cell data of frames in scenes that actuate.
MOTOR_FIELDS = _columns(
    angle_rad="angle of a barb, 0 straight, pi/2 the U; NaN on middle links",
    motor_torque_N_m="torque of the motor at the barb's hinge; NaN on middle links and while welded",
    motor_work_J="work of the motor at the barb's hinge since the start; NaN on middle links and while welded",
    halted="1 where the motor at the barb's hinge is halted by its torque, else 0",
)
