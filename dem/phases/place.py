"""The phase that puts bodies at poses from a file."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal, Self, cast

import numpy as np
from pydantic import Field, ModelWrapValidatorHandler, model_validator
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from dem.arrays import Array, Numbers
from dem.body.kinds import Kind, bodies_of
from dem.body.loops import Curves, curves_of
from dem.body.outline import outline_of
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.posing import Pose, posed
from dem.body.state import FilamentState, LinkageState, PileState, RigidState, State
from dem.engine.interface import Engine
from dem.errors import InputError
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.record.poses import POSES, PosedBody, read_poses
from dem.setting.hooks import Cross
from dem.setting.part import Part, ScenePath, Sha256

MOST_OVERLAP = 0.05  # in diameters; contacts of piles at rest are less deep
NEXT = 3  # bars of a body that bends, from which on they may touch each other, if they are longer than thick


class Place(Part, Phase):
    """Put all bodies at poses from a file, at rest; this takes one time step."""

    begins: ClassVar[bool] = True
    overlap: ClassVar[float] = MOST_OVERLAP
    needs_links: ClassVar[str] = "start poses from a file"
    sources: ClassVar[frozenset[str]] = frozenset({"file"})
    type: Literal["place"]
    file: ScenePath = Field(
        ...,
        description="CSV file with columns body, x, y, z: points of the centre lines of all bodies, heights from the "
        "floor; or a .vtu, such as a frame of a run. Relative to the scene file; the run directory keeps a copy",
    )
    unit: Literal["m", "cm", "mm", "um"] | None = Field(
        None, description="unit of the coordinates; default: that in the header, x [mm], and m for frames of runs"
    )
    sha256: Sha256 | None = Field(
        None,
        description="SHA-256 of the file; default: filled in when the scene is read, so that later changes of the file "
        "are noticed. It counts for the scene's hash; the name of the file does not",
    )

    @model_validator(mode="wrap")
    @classmethod
    def _pinned(cls, data: object, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Return the validated phase, with the hash of the file."""
        made = handler(data)
        if made.sha256 is not None:
            return made
        pinned = {**dict(made), "sha256": hashlib.sha256(_content(Path(made.file))).hexdigest()}
        # The filled key does not count as given by the user: if `file` is changed, it is filled in anew.
        return cast("Self", cls.model_construct(_fields_set=made.model_fields_set, **pinned))

    @property
    def known_duration(self) -> float:
        return 0.0

    @property
    def attached(self) -> tuple[str, bytes]:
        path = Path(self.file)
        content = _content(path)
        if hashlib.sha256(content).hexdigest() != self.sha256:
            raise InputError(
                f"sha256: {path} has other content than when the scene was made; put that back, or leave sha256 out to "
                "take what is there"
            )
        return POSES + path.suffix.lower(), content

    @cached_property
    def _bodies(self) -> tuple[PosedBody, ...]:
        """Bodies of the file; InputError, which begins with a key, if it is damaged."""
        try:
            return read_poses(Path(self.file), unit=self.unit)
        except InputError as error:
            raise InputError(f"file: {error}") from None

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        # A scene without its file can still be read; `ready` rejects it before a run.
        if Path(self.file).exists():
            yield from self._problems(scene)

    def ready(self, scene: SceneView) -> None:
        for problem in self._problems(scene):
            raise InputError(problem)

    def _problems(self, scene: SceneView) -> Iterator[str]:
        """Yield what is wrong with the file, and with the places of its bodies in a scene."""
        try:
            _ = self.attached  # the file may have changed since the scene was read
            poses = self._poses(scene)
        except InputError as error:
            yield f"phases.0.{error}"
            return
        yield from _misplaced(scene, poses, self._bodies)

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        if not Path(self.file).exists():
            return ()
        present, linked = Curves(), []
        curves = curves_of(_state(scene, self._poses(scene)), scene.bodies, thinnest=scene.model.diameter)
        for body, own in zip(self._bodies, curves, strict=True):
            linked += [body.name] if present.linked(own) else []
            present.add(own)
        if not linked:
            return ()
        others = f" and {len(linked) - 1} others" if len(linked) > 1 else ""
        return (
            f"phases.{index}.file: closed bodies are linked, {linked[0]}{others} with bodies before; nothing parts "
            "them, so move them apart in the file unless chain mail is wanted",
        )

    def first_memory(self, scene: SceneView) -> Memory:
        return {"put": False}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        if stage.memory["put"]:
            return 0.0
        stage.memory["put"] = True
        engine.add(self._poses(stage.scene))
        engine.ledger.take_in()
        return engine.time_step

    def _poses(self, scene: SceneView) -> Poses:
        """Return the poses of a scene's bodies; InputError, which begins with a key, if they do not fit the file."""
        found, file = self._bodies, Path(self.file).name
        if len(found) != scene.count:
            raise InputError(f"file: {file} has {len(found)} bodies, but count is {scene.count}; make them equal")
        kinds = _kinds(scene, found, file)
        models = bodies_of(scene.model)
        poses: list[Pose] = []
        for body, kind in zip(found, kinds, strict=True):
            model = models[kind]
            _reject_undetermined(model)
            try:
                poses.append(posed(model, body.segments))
            except InputError as error:
                raise InputError(f"file: {file}, {body.name}: {error}") from None
        bent = tuple(pose.bent for pose in poses if pose.bent is not None)
        return Poses(
            np.array([pose.position for pose in poses]),
            tuple(Rotation.from_matrix(pose.turn) for pose in poses),
            kinds=None if scene.mixture is None else kinds,
            bent=bent or None,
        )


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        msg = f"file: {path} cannot be read ({error.strerror}); give the path of a file of poses"
        raise InputError(msg) from None


def _kinds(scene: SceneView, found: tuple[PosedBody, ...], file: str) -> Numbers:
    """Return the kind (N,) of each body."""
    models = bodies_of(scene.model)
    if len(models) == 1:
        return np.zeros(len(found), np.int64)
    assert scene.mixture is not None  # smarticles are of one kind
    if unknown := [body for body in found if body.kind is None or body.kind >= len(models)]:
        raise InputError(
            f"file: {file}, {unknown[0].name}: kind is {unknown[0].kind}; particle has several shapes: add a column "
            f"kind with numbers from 0 to {len(models) - 1}, and leave spread out"
        )
    kinds = np.array([body.kind for body in found], dtype=np.int64)
    wanted, given = (np.bincount(each, minlength=len(models)) for each in (scene.mixture.of, kinds))
    if (wanted != given).any():
        k = int((wanted != given).argmax())
        raise InputError(
            f"file: {file} has {given[k]} bodies of kind {k}, the scene {wanted[k]} by count or share of its particle; "
            "make them equal"
        )
    return kinds


def _reject_undetermined(model: Particle | Kind) -> None:
    """Raise InputError if centre lines leave open how a body is turned about its length, and this matters."""
    if isinstance(model, Kind) and model.filament is not None and model.filament.curvature is not None:
        raise InputError(
            "file: centre lines leave open in which plane a filament prefers to be bent; leave out "
            "particle.curvature_per_m, or pour"
        )
    if isinstance(model, Kind) and model.linkage is not None:
        for joint in model.linkage.joints:
            if len(joint.axes) == 3 and (any(joint.rest) or any(joint.poured)):
                raise InputError(
                    "file: centre lines leave open how links are turned about their length, on which joints of three "
                    "axes with angles at rest or at the start depend; use joints of one or two axes, or pour"
                )
    points = (model.bars.ends if isinstance(model, Kind) else model.boxes.vertices).reshape(-1, 3)
    rows = model.rows if isinstance(model, Kind) else model.chain.rows
    if rows > 1 and np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-9) < 2:
        raise InputError(
            "file: centre lines leave open how a straight body of several strands is turned about its length; use "
            "fidelity.rows: 1"
        )


def _state(scene: SceneView, poses: Poses) -> PileState:
    turns = np.array([rotation.as_matrix() for rotation in poses.rotations])
    still = np.zeros_like(poses.positions)
    mixture = scene.mixture
    if mixture is None:
        return State.rigid(scene.body.boxes, poses.positions, turns, still, still)
    assert poses.kinds is not None
    if poses.bent is None:
        return RigidState(mixture, poses.kinds, poses.positions, turns, still, still)
    points = np.concatenate([bent.points for bent in poses.bent])
    still = np.zeros_like(points)
    if mixture.flexible:
        return FilamentState(mixture, poses.kinds, points, still, still[:, 0])
    begins = np.cumsum([0, *mixture.sizes])
    pieces = np.concatenate([np.arange(begins[k], begins[k + 1]) for k in poses.kinds])
    frames = np.concatenate([bent.turns for bent in poses.bent if bent.turns is not None])
    return LinkageState(mixture, poses.kinds, RigidState(mixture.pieces, pieces, points, frames, still, still))


@dataclass(frozen=True)
class _Spheres:
    """All S spheres of the outlines of placed bodies, which stand for their bars."""

    places: Array  #: (S, 3) centres [m]
    radii: Array  #: (S,) [m]
    body: Numbers  #: (S,) place of the body of each in the file
    bar: Numbers  #: (S,) number of the bar of each in its body
    apart: Numbers  #: (S,) least difference between the numbers of two bars of its body that may touch
    names: list[str]  #: Names of the bodies

    @property
    def allowed(self) -> Array:
        """(S,) largest overlap of each [m]."""
        return MOST_OVERLAP * 2 * self.radii

    def beyond(self, key: str, place: str, depths: Array, way_out: str) -> Iterator[str]:
        """Yield an error for the sphere that is deepest in what it must not touch; `depths` (S,) [m]."""
        worst = int((depths - self.allowed).argmax())
        if depths[worst] > self.allowed[worst]:
            yield (
                f"{key}: {self.names[self.body[worst]]} of phases.0.file reaches {1e3 * depths[worst]:.3g} mm {place}, "
                f"at {_at(self.places[worst])}; at most {1e3 * self.allowed[worst]:.2g} mm are allowed: {way_out}"
            )

    def overlapping(self) -> Iterator[str]:
        """Yield an error for the deepest overlap of two bodies, or of a body with itself, if it is too deep."""
        one, other = cKDTree(self.places).query_pairs(2 * self.radii.max(), output_type="ndarray").T
        far = np.abs(self.bar[one] - self.bar[other]) >= self.apart[one]
        counted = (self.body[one] != self.body[other]) | far
        one, other = one[counted], other[counted]
        if not len(one):
            return
        apart = np.linalg.norm(self.places[one] - self.places[other], axis=1)
        depths = self.radii[one] + self.radii[other] - apart
        allowed = np.minimum(self.allowed[one], self.allowed[other])
        worst = int((depths - allowed).argmax())
        if depths[worst] > allowed[worst]:
            first, second = (self.names[self.body[ends[worst]]] for ends in (one, other))
            yield (
                f"phases.0.file: {first} overlaps {'itself' if first == second else second} by "
                f"{1e3 * depths[worst]:.3g} mm at {_at(self.places[one[worst]])}; at most {1e3 * allowed[worst]:.2g} "
                "mm are allowed: move them apart"
            )


def _spheres(scene: SceneView, poses: Poses, names: list[str]) -> _Spheres:
    models = bodies_of(scene.model)
    kinds = np.zeros(len(names), np.int64) if poses.kinds is None else poses.kinds
    sizes = np.array([len(model.outline) for model in models])[kinds]
    # Rows of bodies with fewer spheres repeat the last one.
    rows = zip(outline_of(_state(scene, poses), scene.model), sizes, strict=True)
    body = np.repeat(np.arange(len(names)), sizes)
    return _Spheres(
        places=np.concatenate([row[:size] for row, size in rows]),
        radii=np.array([model.radius for model in models])[kinds][body],
        body=body,
        bar=np.concatenate([models[kind].outline_links for kind in kinds]),
        apart=np.array([_apart(model) for model in models])[kinds][body],
        names=names,
    )


def _apart(model: Particle | Kind) -> int:
    """Return the least difference between the numbers of two bars of a body that may touch."""
    if isinstance(model, Kind) and model.bends:
        return NEXT + int(np.pi * model.radius / model.bars.lengths.min())
    return int(np.iinfo(np.int64).max)


def _misplaced(scene: SceneView, poses: Poses, found: tuple[PosedBody, ...]) -> Iterator[str]:
    """Yield an error for bodies outside the container, in a hook, or deep in each other."""
    spheres = _spheres(scene, poses, [body.name for body in found])
    places, radii, cylinder = spheres.places, spheres.radii, scene.cylinder
    heights = places[:, 2]
    yield from spheres.beyond("phases.0.file", "below the floor", radii - heights, "move it up")
    way_out = f"move it down, or raise container.height_m, which is {cylinder.height:.4g} m"
    yield from spheres.beyond("container.height_m", "above the wall", heights + radii - cylinder.height, way_out)
    out = np.hypot(places[:, 0], places[:, 1]) + radii - cylinder.radii(heights)
    way_out = f"move it inwards, or widen container.radius_m, which is {scene.container.radius_m:g} m"
    yield from spheres.beyond("container.radius_m", "out of the wall", out, way_out)
    for name, cross in zip(("lower", "upper"), scene.hooks.crosses if scene.hooks else (), strict=False):
        key, depths = f"hooks.{name}_height_m", radii - _to_cross(cross, places)
        yield from spheres.beyond(key, "into this hook", depths, "move the body or the hook")
    yield from spheres.overlapping()


def _to_cross(cross: Cross, places: Array) -> Array:
    """Return the distances (n,) of places (n, 3) from the surface of a hook's round bars [m]."""
    found = np.full(len(places), np.inf)
    for bar in cross.bars:
        along, thick = int(np.argmax(bar.half)), min(bar.half)
        relative = places - [*bar.middle, cross.height]
        relative[:, along] = np.maximum(0.0, np.abs(relative[:, along]) - (bar.half[along] - thick))
        found = np.minimum(found, np.linalg.norm(relative, axis=1) - thick)
    return found


def _at(place: Array) -> str:
    return f"({', '.join(f'{1e3 * part:.3g}' for part in place)}) mm"
