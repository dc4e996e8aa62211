"""The phase that takes over the smarticles of another run, which any engine may have computed.

A frame holds exact poses, but no contacts: tangential springs are lost, and smarticles begin at rest. On
another engine, or at another fidelity, these poses may overlap: spheres of one chain lie partly in the gaps of another
chain, smooth links do not. Smooth links are first pushed apart where they overlap by more than contacts at rest do.
What is left of overlaps is reduced by steps in which velocities are often set to zero.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, cast

import numpy as np
from pydantic import Field, ModelWrapValidatorHandler, field_validator, model_validator

from dem.arrays import Array, Flags
from dem.body.linear import by_element
from dem.body.placement import Poses, fitted_poses
from dem.engine.interface import Engine
from dem.errors import InputError, RunError, reject, shown
from dem.phases.phase import CHECK_INTERVAL, Memory, Phase, SceneView, Settle, Stage, begin_wait, has_settled
from dem.record.frame import Frame
from dem.record.run import Run, open_run
from dem.setting.hooks import Cross
from dem.setting.part import Part, ScenePath, Sha256

LAST = "last"  # the frame at the end of a run that is done
TAKEN_SECONDS = 0.05  # s, typical time in which a pile that was taken over comes to rest
STRIDE = 10  # steps between checks whether overlapping smarticles fly apart, about one oscillation of a contact
MOST_PUSHED = 0.5  # of the middle link's length; smarticles that are pushed further are not those of the frame
# Largest distance of a recorded vertex from the vertex of the scene's shape that is fitted to it, in sphere diameters.
# On YADE hinges give way by 0.01 in a pile, and contacts at rest are as deep, so that fits add no larger overlaps.
MOST_OFF = 0.02
# Keys of a smarticle that have equal names in run.json.
_SHAPE = ("aspect_ratio", "middle_length_m", "thickness_normal_m", "thickness_in_plane_m")


@dataclass(frozen=True)
class Taken:
    """A frame of another run from which smarticles are taken over."""

    run: Run
    number: int
    frame: Frame

    @property
    def vertices(self) -> Array:
        """(N, 4, 3) vertices of the smarticles, heights above the floor [m]."""
        return self.frame.vertices - [0.0, 0.0, self.frame.floor_z]

    @property
    def sha256(self) -> str:
        """SHA-256 hash of `vertices`, the only content of the frame that is taken over."""
        return hashlib.sha256(np.ascontiguousarray(self.vertices, dtype="<f8").tobytes()).hexdigest()

    @property
    def fastest(self) -> float:
        """Greatest speed of a link's centre in the frame [m/s]; velocities are not taken over."""
        return float(np.linalg.norm(self.frame.link_velocity, axis=-1).max())

    def __str__(self) -> str:
        return f"frame {self.number} of {self.run.path}"


@dataclass(frozen=True)
class Start:
    """Poses with which a scene starts, and how they differ from those of the frame."""

    poses: Poses
    overlap: float = 0.0  #: Largest overlap before smarticles were pushed apart [m]; 0: none was pushed
    mean: float = 0.0  #: Mean over the smarticles of their largest displacements [m]
    most: float = 0.0  #: Largest displacement [m]
    rise: float = 0.0  #: Mean rise of the centres of mass [m]

    @property
    def described(self) -> str:
        """The displacement in words; "" if no smarticle was pushed."""
        if not self.overlap:
            return ""
        return (
            f"overlap by up to {1e3 * self.overlap:.2g} mm as this scene has its links (engine, fidelity): smarticles "
            f"are pushed apart first, by {1e3 * self.mean:.2g} mm on average and {1e3 * self.most:.2g} mm at most"
        )


def take(path: Path, frame: int | str) -> Taken:
    """Return a frame of the run at a path, by its number or `LAST`.

    InputError, which begins with the wrong key, if run or frame are missing or damaged, or the run has not ended.
    """
    try:
        run = open_run(path)
        frames, state = run.frames, run.status.state
    except InputError as error:
        raise InputError(f"run: {error}") from None
    number = len(frames) - 1 if frame == LAST else int(frame)
    msg = ""
    if state == "running":
        msg = f"run: {run} is still being computed; wait until it is done: smarticles status {run}"
    elif frame == LAST and state != "done":
        msg = (
            f"frame: {LAST}, but {run} is {state}; go on with it (smarticles resume {run}), or give the "
            "number of a frame"
        )
    elif number >= len(frames):
        msg = f"frame: {number}, but the frames of {run} are 0 … {len(frames) - 1}; use one of them, or {LAST}"
    if msg:
        raise InputError(msg)
    try:
        return Taken(run, number, frames[number])
    except InputError as error:
        raise InputError(f"frame: {error}") from None


class TakeOver(Part, Phase):
    """Take the smarticles' poses from a frame of another run, at rest, then wait until the pile settles."""

    begins: ClassVar[bool] = True
    of_smarticles: ClassVar[bool] = True
    at_rest: ClassVar[bool] = True
    sources: ClassVar[frozenset[str]] = frozenset({"run", "frame"})
    type: Literal["take-over"]
    run: ScenePath = Field(..., description="directory of the run, relative to the scene file")
    frame: Annotated[int, Field(ge=0, le=10**9)] | Literal["last"] = Field(
        "last",
        description="number of the frame, as in the name of its file; last: the last frame of a run that is done, "
        "whose number is filled in when the scene is read",
    )
    sha256: Sha256 | None = Field(
        None,
        description="SHA-256 of the frame's vertices above the floor; default: filled in when the scene is read, so "
        "that later changes of the frame are noticed. It counts for the scene's hash; run and frame do not",
    )
    settle: Settle = Field(default_factory=Settle, description="when the pile counts as settled")

    @field_validator("frame", mode="before")
    @classmethod
    def _number_or_last(cls, value: Any) -> Any:
        if value != LAST and (not isinstance(value, int) or isinstance(value, bool) or value < 0):
            raise ValueError(f"{shown(value)} is no frame; use its number, from 0, or {LAST}")
        return value

    @model_validator(mode="wrap")
    @classmethod
    def _pinned(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Return the validated phase, with the number of the frame instead of `LAST`, and the frame's hash."""
        made = handler(data)
        if made.sha256 is not None and made.frame != LAST:
            return made
        taken = take(Path(made.run), made.frame)
        pinned = {"frame": taken.number, "sha256": made.sha256 or taken.sha256}
        # The filled keys do not count as given by the user: if `run` is changed, they are filled in anew.
        return cast("Self", cls.model_construct(_fields_set=made.model_fields_set, **{**dict(made), **pinned}))

    @cached_property
    def taken(self) -> Taken:
        """The frame that is taken over; InputError if it is missing or has changed since the scene was made."""
        taken = take(Path(self.run), self.frame)
        if taken.sha256 != self.sha256:
            raise InputError(
                f"sha256: {taken} has other poses than those from which the scene was made ({taken.sha256[:12]}… "
                f"instead of {str(self.sha256)[:12]}…); put that run back, or leave sha256 out to take what is there"
            )
        return taken

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if scene.gravity_m_per_s2 == 0:
            yield "gravity_m_per_s2: 0 m/s²; without gravity no pile settles in phases.0 (take-over)"
        try:
            taken = self.taken
        except InputError:
            return  # a scene without its source can still be read; `ready` rejects it before a run
        yield from _mismatches(scene, taken)

    def ready(self, scene: SceneView) -> None:
        try:
            taken = self.taken
        except InputError as error:
            raise InputError(f"phases.0.{error}") from None
        for mismatch in _mismatches(scene, taken):
            raise InputError(mismatch)
        self.start(scene)

    @cached_property
    def _started(self) -> list[tuple[SceneView, Start]]:
        """The scene for which `start` was called last, and the result, which takes seconds to compute."""
        return []

    def start(self, scene: SceneView) -> Start:
        """Return the poses with which a scene starts; InputError if smarticles cannot be pushed apart."""
        if not self._started or self._started[0][0] is not scene:
            self._started[:] = [(scene, _start(scene, self.taken))]
        return self._started[0][1]

    def origin(self, scene: SceneView) -> Mapping[str, Any]:
        taken, start = self.taken, self.start(scene)
        return {
            "run": self.run,
            "frame": self.frame,
            "sha256": self.sha256,
            "time_s": taken.frame.time,
            "fastest_m_per_s": taken.fastest,
            "scene_sha256": taken.run.manifest.scene_sha256,
            "seed": taken.run.manifest.seed,
            "engine": taken.run.manifest.engine,
            "overlap_m": start.overlap,
            "pushed_mean_m": start.mean,
            "pushed_most_m": start.most,
        }

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        try:
            taken = self.taken
        except InputError:
            return ()
        limit, found = self.settle.speed_m_per_s, []
        if taken.fastest >= limit:
            found.append(
                f"phases.0.frame: {taken} is not at rest, up to {taken.fastest:.3g} m/s (settle.speed_m_per_s is "
                f"{limit:g} m/s), and velocities are not taken over; use a frame at the end of a relax phase"
            )
        try:
            pushed = self.start(scene).described
        except InputError as error:  # `ready` rejects the scene before a run
            return (*found, str(error))
        if pushed:
            found.append(f"phases.0.run: poses of {taken} {pushed}; for less pour on the same engine and fidelity")
        return found

    def expected_duration(self, scene: SceneView) -> float:
        # Nothing falls: the pile settles in little more than `hold_s`.
        return self.settle.hold_s + TAKEN_SECONDS

    def first_memory(self, scene: SceneView) -> Memory:
        # `task`: the next action; `stops`: how often velocities were set to zero; `height`: mean height of smarticles
        # when they were added [m], which begins the wait; `still`: time for which the pile has been still [s].
        memory: Memory = {"task": "put", "stops": 0, "height": 0.0, "still": 0.0}
        begin_wait(memory)
        return memory

    def proceed(self, stage: Stage, engine: Engine) -> float:
        wait = self._do(stage, engine)
        stage.memory["waited"] += wait
        return wait

    def _do(self, stage: Stage, engine: Engine) -> float:
        memory, settle, stride = stage.memory, self.settle, STRIDE * engine.time_step
        if memory["task"] == "put":
            self.ready(stage.scene)
            start = self.start(stage.scene)
            engine.add(start.poses)
            engine.ledger.take_in()
            memory.update(task="count", height=_mean_height(engine) - start.rise)
            return engine.time_step
        if memory["task"] == "count":
            # Some engines find contacts in the first step only, which therefore belongs to no stride.
            memory["task"] = "let apart"
            return stride
        if memory["task"] == "let apart":
            fastest = float(engine.state().speeds.max())
            _reject_thrown(engine, stride, stage.scene.sphere_diameter)
            if fastest > settle.speed_m_per_s + stride * engine.gravity:
                if memory["waited"] > settle.timeout_s:
                    raise RunError(
                        f"the smarticles still push each other apart {settle.timeout_s:g} s after they were put in, up "
                        f"to {fastest:.3g} m/s in {STRIDE} steps (limit {settle.speed_m_per_s:g} m/s); raise "
                        "phases.0.settle.speed_m_per_s, or pour on this engine"
                    )
                engine.still()
                memory["stops"] += 1
                return stride
            memory["task"] = "settle"
            if memory["stops"]:
                memory["warning"] = (
                    f"poses of {self.run} overlap as this scene has its links (engine, fidelity): smarticles were "
                    f"stopped {memory['stops']} times in {memory['waited']:.3g} s while contacts let them apart, and "
                    f"stand {1e3 * (_mean_height(engine) - memory['height']):.2g} mm higher on average"
                )
        return 0.0 if has_settled(settle, memory, engine) else CHECK_INTERVAL


def _mean_height(engine: Engine) -> float:
    return float(engine.state().positions[:, 2].mean())


def _reject_thrown(engine: Engine, time: float, diameter: float) -> None:
    """Raise RunError if smarticles have moved by more than a diameter [m] in the time since they were at rest [s]."""
    speeds = engine.state().speeds
    reject(
        speeds * time > diameter,
        engine.time,
        f"overlap so much where they were put in that contacts throw them apart, at up to {speeds.max():.3g} m/s "
        f"within {STRIDE} steps, so that links may have passed through each other",
        "take over on the engine and at the fidelity of phases.0.run first, or pour on this engine",
    )


def _start(scene: SceneView, taken: Taken) -> Start:
    """Return the poses with which a scene starts; InputError if smarticles cannot be pushed apart."""
    poses = poses_of(scene, taken)
    if not scene.smooth:
        return Start(poses)
    # Numba, which this module imports, takes half a second to load.
    from dem.engine.links.apart import pushed_apart  # noqa: PLC0415

    way_out = "take over a run of this engine and fidelity, or pour here"
    try:
        pushed = pushed_apart(scene.body, poses, scene.cylinder, scene.hooks.crosses if scene.hooks else ())
    except InputError as error:
        msg = f"phases.0.run: smarticles of {taken} cannot be pushed apart as links: {error}; {way_out}"
        raise InputError(msg) from None
    if pushed is None:
        return Start(poses)
    rise = float((pushed.poses.positions - poses.positions)[:, 2].mean())
    start = Start(pushed.poses, pushed.deepest, float(pushed.distances.mean()), float(pushed.distances.max()), rise)
    limit = MOST_PUSHED * scene.body.size
    if start.most > limit:
        raise InputError(
            f"phases.0.run: poses of {taken} {start.described}; at most {1e3 * limit:.3g} mm are allowed: {way_out}"
        )
    if pushed.highest > scene.cylinder.height:
        raise InputError(
            f"container.height_m: {scene.cylinder.height:.4g} m, but the smarticles of {taken} {start.described}, and "
            f"then reach {pushed.highest:.4g} m; use a higher container"
        )
    return start


def poses_of(scene: SceneView, taken: Taken) -> Poses:
    """Return the poses of a scene's smarticles from a frame; raise InputError if it does not fit them."""
    for mismatch in _mismatches(scene, taken):
        raise InputError(mismatch)
    return fitted_poses(scene.body.boxes, taken.vertices)[0]


def _mismatches(scene: SceneView, taken: Taken) -> Iterator[str]:
    """Yield errors where a frame does not fit the scene; later checks assume that earlier ones found none."""
    manifest, taking = taken.run.manifest, "which phases.0 (take-over) takes over"
    if manifest.planar:
        yield f"phases.0.run: {taken.run} is a run in a plane; take over one in a container"
    for key in _SHAPE:
        here, there = getattr(scene.smarticle, key), getattr(manifest, key)
        if not math.isclose(here, there, rel_tol=1e-9):
            unit = "" if key == "aspect_ratio" else " m"
            yield (
                f"smarticle.{key}: {here:g}{unit} here, but {there:g}{unit} in {taken.run}, {taking}; use "
                f"{there:g}{unit}, or another run"
            )
    if taken.frame.count != scene.count:
        whole = "" if taken.frame.count == manifest.count else f" of {manifest.count}, poured so far"
        yield (
            f"count: {scene.count} here, but {taken}, {taking}, holds {taken.frame.count}{whole}; use "
            f"{taken.frame.count}, or another frame"
        )
    straight = scene.smarticle.aspect_ratio == 0 or scene.smarticle.angles_deg == (0.0, 0.0)
    if straight and scene.fidelity.rows > 1:
        yield (
            f"fidelity.rows: {scene.fidelity.rows}, but frames do not record how a straight smarticle is turned about "
            "its length, which phases.0 (take-over) needs for more than 1; use 1, or angles_deg that are not 0"
        )
    # No link's axis may lie outside the wall, under the floor or in a hook: no contact would push it back.
    cylinder, vertices = scene.cylinder, taken.vertices
    heights, off_axis = vertices[..., 2], np.hypot(vertices[..., 0], vertices[..., 1])
    beyond = (off_axis > cylinder.radii(heights) * (cylinder.corner_radius / cylinder.radius)).any(axis=1)
    if beyond.any():
        yield (
            f"container.radius_m: {scene.container.radius_m:g} m; {beyond.sum()} smarticles of {taken}, {taking}, "
            f"reach out of it, up to {off_axis.max():.4g} m from the axis; use a wider container or another run"
        )
    lowest = float(_within_tips(vertices, scene.body.radius)[..., 2].min())
    if heights.max() > cylinder.height or lowest < 0:
        yield (
            f"container.height_m: {cylinder.height:.4g} m, but the smarticles of {taken}, {taking}, lie at "
            f"{lowest:.4g} to {heights.max():.4g} m; use a higher container or another run"
        )
    for name, cross in zip(("lower", "upper"), scene.hooks.crosses if scene.hooks else (), strict=False):
        inside = _in_cross(cross, vertices)
        if inside.any():
            yield (
                f"hooks.{name}_height_m: {cross.height:g} m; {inside.sum()} smarticles of {taken}, {taking}, lie in "
                "this hook; take over a run that was poured with these hooks"
            )
    _, deviations = fitted_poses(scene.body.boxes, vertices)
    if deviations.max() <= MOST_OFF * scene.sphere_diameter:
        return
    angles = _angles(taken)
    low, high = angles.min(axis=0), angles.max(axis=0)
    reached = " and ".join(f"{a:.4g}° … {b:.4g}°" for a, b in zip(low, high, strict=True))
    (first, second), middle = scene.smarticle.angles_deg, (low + high) / 2
    # A scene can describe barbs whose angles are equal on all smarticles.
    spread = math.radians(float((high - low).max()) / 2) * scene.body.boxes.barb_length
    way_out = (
        f"use smarticle.angles_deg: [{middle[0]:.4g}, {middle[1]:.4g}]"
        if spread < MOST_OFF * scene.sphere_diameter
        else "all smarticles of a scene begin with equal angles: take a frame in which their angles are equal"
    )
    yield (
        f"smarticle.angles_deg: ({first:g}, {second:g}) here, but the barbs of {taken}, {taking}, stand at {reached}; "
        f"{way_out}"
    )


def _within_tips(vertices: Array, radius: float) -> Array:
    """Return smarticles' vertices (N, 4, 3) [m] with both tips moved inwards by a sphere's radius [m].

    Moved tips are the centres of spheres that end at the original tips. A tip moves along its barb, or along the middle
    link if barbs have no length, at most to the other end.
    """
    moved = vertices.copy()
    for tip, hinge, far in ((0, 1, 2), (3, 2, 1)):
        # Without barbs the middle link ends at the tips.
        vectors = [vertices[:, end] - vertices[:, tip] for end in (hinge, far)]
        lengths = [np.linalg.norm(vector, axis=-1, keepdims=True) for vector in vectors]
        shares = [np.minimum(1.0, radius / np.maximum(length, 1e-300)) for length in lengths]
        barbed = lengths[0] > 0
        moved[:, tip] += np.where(barbed, shares[0] * vectors[0], shares[1] * vectors[1])
        moved[:, hinge] = np.where(barbed, moved[:, hinge], moved[:, tip])
    return moved


def _in_cross(cross: Cross, vertices: Array) -> Flags:
    """Return (N,) whether the axis of any link of a smarticle passes through a bar of a hook.

    Axes are sampled at points at most a quarter of the bars' thickness apart.
    """
    ends = np.stack([vertices[:, :-1], vertices[:, 1:]], axis=2)  # (N, 3, 2, 3)
    longest = float(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1).max())
    shares = np.linspace(0, 1, 2 + int(4 * longest / cross.side))[:, None]
    points = (ends[:, :, :1] * (1 - shares) + ends[:, :, 1:] * shares).reshape(len(vertices), -1, 3)
    relative = points - [0.0, 0.0, cross.height]
    inside = [(np.abs(relative - [*bar.middle, 0.0]) < bar.half).all(axis=-1).any(axis=-1) for bar in cross.bars]
    return np.asarray(np.logical_or.reduce(inside))


def _angles(taken: Taken) -> Array:
    """Return the barbs' angles (N, 2) in a frame [deg].

    If the frame does not hold them they are computed from the vertices, which give absolute values only.
    """
    recorded = taken.frame.cell_data.get("angle_rad")
    if recorded is not None:
        return np.asarray(np.degrees(recorded[:, [0, 2]]))
    tip_1, hinge_1, hinge_2, tip_2 = np.moveaxis(taken.vertices, 1, 0)
    along = hinge_2 - hinge_1
    cosines = [
        np.einsum("ni,ni->n", axis, barb) / np.linalg.norm(axis, axis=1) / np.linalg.norm(barb, axis=1)
        for axis, barb in ((-along, tip_1 - hinge_1), (along, tip_2 - hinge_2))
    ]
    return np.asarray(np.degrees(by_element(math.acos, np.clip(cosines, -1, 1))).T)
