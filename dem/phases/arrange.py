"""The phase that lays smarticles out as a chain, in a plane."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from dem.body.chain import Chain
from dem.engine.interface import Engine
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.setting.part import Length, Part

LEAST_COUNT = 2


class Arrange(Part, Phase):
    """Lay the smarticles out as a chain, ⊔-⊓-⊔…, each hooked into the next; takes no time."""

    planar: ClassVar[bool | None] = True
    begins: ClassVar[bool] = True
    type: Literal["arrange"]
    gap_m: Length = Field(..., description="free distance of neighbours where they will touch first [m]")

    def check(self, scene: SceneView, index: int) -> None:
        _check_links(scene, chain_of(scene))
        if scene.plane is not None and scene.plane.width_m is not None:
            _check_walls(scene, chain_of(scene), scene.plane.width_m)

    @property
    def known_duration(self) -> float:
        return 0.0

    @property
    def progress_duration(self) -> None:
        return

    def begin(self, scene: SceneView, index: int) -> Stage:
        return Arranging(chain_of(scene))


def chain_of(scene: SceneView) -> Chain:
    """Return the chain of a scene that begins with one."""
    first = scene.phases[0]
    assert isinstance(first, Arrange)  # the caller has checked
    return Chain(scene.particle, scene.count, first.gap_m)


def _check_links(scene: SceneView, chain: Chain) -> None:
    if scene.count < LEAST_COUNT:
        msg = f"count: {scene.count} is no chain; use at least {LEAST_COUNT}"
        raise ValueError(msg)
    if scene.smarticle.angles_deg != (90.0, 90.0):
        first, second = scene.smarticle.angles_deg
        msg = f"smarticle.angles_deg: a chain is laid out of U shapes, not of ({first:g}, {second:g}); use (90, 90)"
        raise ValueError(msg)
    d, mouth = scene.sphere_diameter, scene.smarticle.middle_length_m
    if mouth < 3 * (d + chain.gap):
        msg = (
            f"phases.0.gap_m: two barbs of {d:.4g} m and three gaps of {chain.gap:g} m do not fit into a mouth of "
            f"{mouth - d:.4g} m; use a smaller gap or thinner links"
        )
        raise ValueError(msg)


def _check_walls(scene: SceneView, chain: Chain, width: float) -> None:
    if width <= chain.width:
        msg = (
            f"plane.width_m: H = {width:g} m leaves no room for a chain that is h = {chain.width:.4g} m wide, h/H = "
            f"{chain.width / width:.3g}; h/H must be below 1"
        )
        raise ValueError(msg)
    # Hooked tip to tip, with barbs at right angles: no opening of the servos makes a chain wider, short of one that
    # turns as a whole, whose middle links then add their share.
    widest = 2 * scene.particle.boxes.barb_length + scene.smarticle.middle_length_m
    if width > widest:
        msg = (
            f"plane.width_m: H = {width:g} m, h/H = {chain.width / width:.3g}, is beyond the stroke of the servos: the "
            f"chain gets no wider than {widest:.4g} m before it parts; use less, or leave width_m out for no walls"
        )
        raise ValueError(msg)


class Arranging:
    """Lays out the chain at once."""

    def __init__(self, chain: Chain) -> None:
        self._chain = chain
        self.memory: Memory = {}

    def proceed(self, engine: Engine) -> float:
        engine.add(self._chain.poses())
        return 0.0
