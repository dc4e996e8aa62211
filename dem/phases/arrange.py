"""The phase that arranges smarticles as a chain in a plane."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from dem.body.chain import Chain
from dem.engine.interface import Engine
from dem.phases.phase import Phase, SceneView, Stage
from dem.setting.part import Length, Part

LEAST_COUNT = 2


class Arrange(Part, Phase):
    """Arrange the smarticles as a chain, ⊔-⊓-⊔…, each hooked into the next; takes no simulated time."""

    planar: ClassVar[bool | None] = True
    begins: ClassVar[bool] = True
    of_smarticles: ClassVar[bool] = True
    type: Literal["arrange"]
    gap_m: Length = Field(..., description="free distance of neighbours where they will touch first [m]")

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        chain = chain_of(scene)
        if scene.count < LEAST_COUNT:
            yield f"count: {scene.count} is no chain; use at least {LEAST_COUNT}"
        if scene.smarticle.angles_deg != (90.0, 90.0):
            first, second = scene.smarticle.angles_deg
            yield f"smarticle.angles_deg: a chain is laid out of U shapes, not of ({first:g}, {second:g}); use (90, 90)"
        d, mouth = scene.sphere_diameter, scene.smarticle.middle_length_m
        if mouth < 3 * (d + chain.gap):
            yield (
                f"phases.0.gap_m: two barbs of {d:.4g} m and three gaps of {chain.gap:g} m do not fit into a mouth of "
                f"{mouth - d:.4g} m; use a smaller gap or thinner links"
            )
        width = None if scene.plane is None else scene.plane.width_m
        if width is None:
            return
        if width <= chain.width:
            yield (
                f"plane.width_m: H = {width:g} m leaves no room for a chain that is h = {chain.width:.4g} m wide, h/H "
                f"= {chain.width / width:.3g}; h/H must be below 1"
            )
        # The widest chain is hooked tip to tip, with barbs at right angles; if it turns as a whole, the length of a
        # middle link is added.
        widest = 2 * scene.body.boxes.barb_length + scene.smarticle.middle_length_m
        if width > widest:
            yield (
                f"plane.width_m: H = {width:g} m, h/H = {chain.width / width:.3g}, is beyond the stroke of the servos: "
                f"the chain gets no wider than {widest:.4g} m before it parts; use less, or leave width_m out for no "
                "walls"
            )

    @property
    def known_duration(self) -> float:
        return 0.0

    def proceed(self, stage: Stage, engine: Engine) -> float:
        engine.add(chain_of(stage.scene).poses())
        return 0.0


def chain_of(scene: SceneView) -> Chain:
    """Return the layout of the chain with which a scene begins."""
    first = scene.phases[0]
    assert isinstance(first, Arrange)  # the caller has checked
    return Chain(scene.body, scene.count, first.gap_m)
