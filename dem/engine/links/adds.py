"""Additions of each effect on the engine links, by names of kernels.

A kernel that no effect needs is not compiled.
"""

from collections.abc import Mapping

from dem.engine.effect import Adds, EffectName

ADDS: Mapping[EffectName, Adds] = {
    EffectName.CONTACT: Adds(
        engines=("pose", "update_lists", "push_apart", "kick", "drift"), shapes=("swept segments",)
    ),
    EffectName.CONTAINER: Adds(engines=("push_boundaries",), shapes=("floor", "round wall")),
    EffectName.PLANE: Adds(engines=("push_boundaries",), python="two walls instead of the container"),
    EffectName.STRINGS: Adds(engines=("pull",)),
    EffectName.CONTAINER_MOTION: Adds(python="a sine per step"),
    EffectName.ARTICULATION: Adds(python="the plane geometry of every smarticle twice in a step, while articulated"),
    EffectName.MOTORS: Adds(python="one control update of all motors per control period"),
    EffectName.HOOKS: Adds(shapes=("square bars",)),
    EffectName.WALL_REMOVAL: Adds(python="the lower edge of a wall, while it is lifted"),
    EffectName.PLATE: Adds(shapes=("plane",)),
    EffectName.GRIPS: Adds(engines=("hold",)),
    EffectName.FILAMENTS: Adds(
        engines=("move_segments", "push_nodes", "kick_nodes", "drift_nodes"), python="bends between all segments"
    ),
    EffectName.JOINTS: Adds(
        engines=("pose_linkages", "push_joints", "kick_links", "drift_links"), python="every joint twice in a step"
    ),
    EffectName.ENERGY_ACCOUNT: Adds(engines=("settle",), python="every contact's velocity twice in a step"),
    EffectName.CHECKPOINTS: Adds(python="copies all arrays once per checkpoint"),
}

ORDER = (
    "pose",
    "move_segments",
    "pose_linkages",
    "update_lists",
    "push_apart",
    "push_boundaries",
    "pull",
    "push_nodes",
    "push_joints",
    "kick",
    "hold",
    "kick_nodes",
    "kick_links",
    "settle",
    "drift",
    "drift_nodes",
    "drift_links",
)
