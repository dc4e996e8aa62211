"""The phase that pours bodies, layer by layer."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from dem.arrays import Array, Flags
from dem.body.loops import curves_of
from dem.body.outline import outline_of, tops_of
from dem.body.placement import place_layer
from dem.body.state import PileState
from dem.engine.interface import Engine
from dem.errors import RunError
from dem.phases.phase import (
    CHECK_INTERVAL,
    SETTLE_SECONDS,
    Memory,
    Phase,
    SceneView,
    Settle,
    Stage,
    begin_wait,
    has_settled,
    waits_in_vain,
)
from dem.setting.container import Cylinder
from dem.setting.part import Part, Speed

# Time after which a layer must have landed, or lose energy: at least 2 s, and 10 times that of a fall √(2h/g) over the
# wall's height h, the longest fall that there is; at 9.81 m/s² the fall of a layer takes less than 0.1 s.
LAYER_TIMEOUT = 2.0  # s
LANDING_FALLS = 10
LAYER_SECONDS = 0.125  # s, typical time between two layers of a pour; measured on YADE and links, N = 100 … 270


class Deposit(Part, Phase):
    """Pour bodies in layers of random poses without overlaps or links, then wait until the pile settles.

    A layer is poured just above the pile after the previous layer has landed. If `every_s` is given, layers are poured
    from the top of the wall at this interval. Closed bodies, such as rings, are never linked with each other.
    """

    begins: ClassVar[bool] = True
    at_rest: ClassVar[bool] = True
    pours: ClassVar[bool] = True
    type: Literal["deposit"]
    per_layer: int = Field(10, ge=1, le=100_000, description="bodies per layer [1]")
    layer_height_w: float = Field(
        1.0,
        ge=1e-3,
        le=10,
        description="height of the slab above the pile that a layer is spread over, in units of w, or of the longest "
        "bar of other bodies [1]",
    )
    landed_speed_m_per_s: Speed = Field(
        0.2,
        description="a layer has landed when each of its bodies touches something and falls slower than this [m/s]",
    )
    every_s: float | None = Field(
        None,
        ge=1e-4,
        le=1e6,
        description="interval between two layers [s], which are poured from the top of the wall, as in the paper's own "
        "code; default: a layer is poured when the previous one has landed",
    )
    thrown_at_m_per_s: float = Field(
        0.0, ge=0, le=1000, description="speed that bodies are thrown down with, 0 to let them fall [m/s]"
    )
    settle: Settle = Field(default_factory=Settle, description="when the poured pile counts as settled")

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if scene.gravity_m_per_s2 == 0:
            yield "gravity_m_per_s2: 0 m/s²; without gravity nothing comes down in phases.0 (deposit)"
        height = scene.container.height_m
        # The slab that a layer is poured into must end below the wall, with a body that lies flat on its top.
        slab = self.layer_height_w * scene.model.size
        least = 2 * scene.model.radius + slab + scene.model.reach
        if height is not None and height < least:
            key = "container.height_m" if scene.container.tiers is None else "container.tiers"
            what = "it" if scene.container.tiers is None else "height_m of the top tier"
            yield (
                f"{key}: {height:g} m of wall is too low for one layer of the pour, spread over "
                f"phases.0.layer_height_w = {self.layer_height_w:g} w, which reaches {least:.4g} m; raise {what} by at "
                f"least {least - height:.3g} m or lower layer_height_w"
            )

    def expected_duration(self, scene: SceneView) -> float:
        layer = LAYER_SECONDS if self.every_s is None else self.every_s
        return layer * math.ceil(scene.count / self.per_layer) + SETTLE_SECONDS

    def peak_speed(self, gravity: float) -> float:
        return self.thrown_at_m_per_s

    def first_memory(self, scene: SceneView) -> Memory:
        rng = np.random.default_rng(scene.seed_for("deposit"))
        # `left`: bodies to pour; `layer`: bodies of the layer that falls; `still`: time for which the pile has been
        # still [s]. A wait begins with the pour of a layer, and when it has landed.
        memory: Memory = {"left": scene.count, "layer": 0, "still": 0.0, "random": rng.bit_generator.state}
        begin_wait(memory)
        return memory

    def proceed(self, stage: Stage, engine: Engine) -> float:
        memory = stage.memory
        if memory["left"] and self.every_s is not None:
            self._pour(stage, engine)
            memory["layer"] = 0  # the next layer does not wait for this one
            return self.every_s
        if memory["layer"]:
            self._check_layer(memory, engine, stage.scene.gravity_m_per_s2)
        elif not memory["left"] and has_settled(self.settle, memory, engine):
            return 0.0
        if memory["left"] and not memory["layer"]:
            self._pour(stage, engine)
        memory["waited"] += CHECK_INTERVAL
        return CHECK_INTERVAL

    def _check_layer(self, memory: Memory, engine: Engine, gravity: float) -> None:
        size, limit, state = memory["layer"], self.landed_speed_m_per_s, engine.state()
        fastest = float(-state.velocities[-size:, 2].min())
        # Contacts are looked for only where the answer depends on them.
        aloft = int((engine.touches()[-size:] == 0).sum()) if fastest < limit else 0
        timeout = max(LAYER_TIMEOUT, LANDING_FALLS * math.sqrt(2 * engine.cylinder.height / gravity))
        if fastest < limit and not aloft:
            memory["layer"] = 0
            begin_wait(memory)
        elif waits_in_vain(memory, state.kinetic_energy, timeout):
            cause = f"the fastest falls at {fastest:.3g} m/s, limit {limit:g} m/s; raise phases.0.landed_speed_m_per_s"
            if fastest < limit:
                cause = (
                    f"{aloft} of them touch nothing at {gravity:g} m/s² of gravity, so that they still fall or bounce; "
                    "lower contact.restitution or phases.0.layer_height_w, or raise gravity_m_per_s2"
                )
            raise RunError(f"a layer of {size} had not come down {memory['judged']:.3g} s after it was poured: {cause}")

    def _pour(self, stage: Stage, engine: Engine) -> None:
        scene, memory = stage.scene, stage.memory
        size = min(self.per_layer, memory["left"])
        rng = np.random.default_rng()
        rng.bit_generator.state = memory["random"]
        particle, mixture, state = scene.model, scene.mixture, engine.state()
        cylinder, slab = engine.cylinder, self.layer_height_w * particle.size
        if self.every_s is None:
            # Rows of flat bars may reach higher; they are obstacles, and none of the layer begins in them.
            bottom = state.tops.max(initial=engine.boundaries.floor) + particle.radius
        else:
            # Earlier layers may still fall: a fixed height keeps the distance between layers.
            bottom = cylinder.height - slab - 2 * particle.reach
        near = tops_of(state, particle) > bottom - 3 * particle.radius
        hooks = [cross.obstacles(2 * particle.radius) for cross in (scene.hooks.crosses if scene.hooks else ())]
        poured = scene.count - memory["left"]
        kinds = None if mixture is None else mixture.of[poured : poured + size]
        poses = place_layer(
            scene.bodies[0] if kinds is None else [scene.bodies[k] for k in kinds],
            count=size,
            radius=float(cylinder.inner_radii(np.array([bottom]))[0]),
            bottom=bottom,
            height=slab,
            obstacles=np.concatenate([outline_of(state, particle)[near].reshape(-1, 3), *hooks]),
            rng=rng,
            narrower=cylinder.inner_radii if cylinder.upper else None,
            thickest=particle.radius,
            curves=_curves(scene, cylinder, state, near),
            thinnest=particle.diameter,
        )
        highest = poses.positions[:, 2].max() + particle.reach
        if highest > cylinder.height:
            key = "container.height_m" if scene.container.tiers is None else "height_m of the top tier"
            noun = "smarticles" if mixture is None else "bodies"
            raise RunError(
                f"{scene.count} {noun} do not fit: after {engine.count} the next layer would reach {highest:.3g} "
                f"m, above container.height_m = {cylinder.height:.3g} m; lower count or raise {key}"
            )
        if kinds is not None:
            poses = replace(poses, kinds=kinds)
        engine.add(poses, speed=self.thrown_at_m_per_s)
        memory.update(left=memory["left"] - size, layer=size, random=rng.bit_generator.state)
        begin_wait(memory)


def _curves(scene: SceneView, cylinder: Cylinder, state: PileState, which: Flags) -> list[Array]:
    """Return the corners (n, 3) [m] of all closed curves that are there.

    They are those of bodies, `which` (N,), and bars of hooks that end at the wall, too near for the thinnest bar.
    """
    thinnest = scene.model.diameter
    curves = curves_of(state, scene.bodies, thinnest=thinnest)
    found = [curve for own, wanted in zip(curves, which, strict=True) if wanted for curve in own]
    for cross in scene.hooks.crosses if scene.hooks else ():
        found += cross.closed(wall=float(cylinder.inner_radii(np.array([cross.height]))[0]), narrow=thinnest)
    return found
