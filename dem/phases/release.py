"""The phase that takes the container away, as data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field

from dem.setting.part import Duration, Part

if TYPE_CHECKING:
    from dem.scene.scene import Scene


class RemoveContainer(Part):
    """Take the container's wall away and let the pile rest on its floor, which has no end. Motors hold.

    Smarticles are not held back from then on: how far they go is measured, not refused. A later phase that shakes the
    container shakes the floor, and those that have rolled away with it.
    """

    type: Literal["remove-container"]
    duration_s: Duration = Field(1.0, description="length of the phase [s]")
    parts: Literal["wall"] = Field("wall", description="what is taken away: the whole wall, every tier of it")
    speed_m_per_s: float | None = Field(
        None,
        gt=0,
        description="speed at which the wall is lifted, rubbing along the pile, until its lower edge is above the pile "
        "[m/s]; a wall that is not clear of it at the end of the phase stays where it is; null: gone at once",
    )


def check_release(scene: Scene) -> None:
    """Check that the container is taken away once at most.

    Raises:
        ValueError: one line with key, value and the way out.
    """
    removed: int | None = None
    for index, phase in enumerate(scene.phases):
        if isinstance(phase, RemoveContainer):
            if removed is not None:
                msg = f"phases.{index}: remove-container, but phases.{removed} did so already; leave one of them out"
                raise ValueError(msg)
            removed = index
