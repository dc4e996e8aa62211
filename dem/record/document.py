"""JSON files of a run directory: `run.json`, `done.json`, `failed.json` and `progress.json`."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.types import NonNegativeFloat, NonNegativeInt, PositiveFloat, PositiveInt

from dem.errors import RunError, shown
from dem.record.files import cannot_read, write_text
from dem.record.names import DONE, FAILED

REMEDY = "give the directory of a run made by `smarticles run`"


class Document(BaseModel):
    """A JSON object with typed keys; unknown keys are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False, strict=True)
    remedy: ClassVar[str] = REMEDY

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the content of a file; raise InputError if it is missing or damaged, or lacks a key."""
        try:
            return cls.model_validate_json(path.read_bytes())
        except OSError as error:
            cannot_read("manifest", path, error, cls.remedy)
        except ValidationError as error:
            found = error.errors(include_url=False)[0]
            place = [*map(str, found["loc"])]
            text = found["msg"].removeprefix("Value error, ")
            if found["type"] not in ("missing", "json_invalid", "value_error"):
                text += f", got {shown(found['input'])}"
            cannot_read("manifest", path, ": ".join([".".join(place), text] if place else [text]), cls.remedy)

    def write(self, path: Path, *, make_folder: bool = False) -> None:
        """Write a file, without keys that are None, and make its folder if `make_folder`."""
        write_text(path, self.model_dump_json(indent=2, exclude_none=True) + "\n", make_folder=make_folder)


class Phase(Document):
    """One phase of a run: its time step in `run.json`, its simulated times and cost in `done.json`."""

    index: NonNegativeInt
    type: str
    #: Whether nothing drives the smarticles during the phase; if the file lacks it, it follows from `type`
    at_rest: bool = Field(default_factory=lambda data: data.get("type") in ("deposit", "take-over", "relax"))
    time_step_s: PositiveFloat | None = None
    start_s: NonNegativeFloat | None = None
    end_s: NonNegativeFloat | None = None
    wall_s: NonNegativeFloat | None = None
    cpu_s: NonNegativeFloat | None = None


class Kind(Document):
    """A kind of bodies other than smarticles."""

    shape: str
    bodies: NonNegativeInt  #: Number of bodies of this kind
    bars: PositiveInt  #: Number of bars of each body
    mass_kg: PositiveFloat
    volume_m3: PositiveFloat  #: Solid volume of each body; overlaps of bars at joints count twice
    length_m: PositiveFloat  #: Sum of the bars' lengths
    thickness_normal_m: PositiveFloat  #: Thickness along the normal; diameter of a round section
    thickness_in_plane_m: PositiveFloat  #: Thickness in the plane; diameter of a round section
    round: bool
    sphere_diameter_m: PositiveFloat  #: Diameter of the spheres, or strands, that represent a body

    @property
    def flexible(self) -> bool:
        """Whether the bodies are filaments or chains, which change their shape."""
        return self.shape in ("filament", "chain")

    @property
    def capped(self) -> bool:
        """Whether round caps reach beyond the ends of the bodies."""
        return self.shape == "filament"


class Start(Document):
    """One start of a run, at its beginning or at a resume."""

    started: str  #: Date and time
    time_s: NonNegativeFloat = 0.0  #: Simulated time from which it goes on
    machine: str | None = None  #: Name of the machine; None: not recorded
    command: str
    threads: NonNegativeInt
    versions: Mapping[str, str]

    def to_text(self) -> str:
        """Return program, engine and machine as text."""
        software = [f"{name} {number}" for name, number in self.versions.items() if name not in HARDWARE]
        machine = [part for part in (self.machine, self.versions.get("processor")) if part]
        return ", ".join(software) + (f"; on {', '.join(machine)}" if machine else "")


HARDWARE = ("processor", "blas")  #: Names in `Start.versions` that follow from the machine


class Manifest(Document):
    """Manifest of a run, `run.json`: how it was made, and numbers of its scene."""

    format: Literal[1] = 1
    name: str
    scene_sha256: str
    seed: NonNegativeInt
    command: str
    started: str
    versions: Mapping[str, str]
    #: Name of the engine; if the file lacks it, it follows from `versions`
    engine: str = Field(default_factory=lambda data: "links" if "links" in data["versions"] else "yade")
    threads: NonNegativeInt  #: Number of threads of the engine, or of ranks on lammps
    fidelity: str  #: Named fidelity that gives the defaults of the scene's parameters
    count: PositiveInt
    #: Barb length over middle length, l/w [1]; 0 for other bodies than smarticles. For these, `middle_length_m` is the
    #: length of the longest bar; mass and volume are means over bodies; thicknesses and sphere diameter are the
    #: smallest ones, and `spheres_per_smarticle` is the largest one, of all kinds
    aspect_ratio: NonNegativeFloat
    middle_length_m: PositiveFloat
    barb_length_m: NonNegativeFloat
    thickness_normal_m: PositiveFloat  #: Thickness t1 along the normal of the smarticle's plane
    thickness_in_plane_m: PositiveFloat  #: Thickness t2 in the smarticle's plane
    middle_thickness_in_plane_m: PositiveFloat | None = None  #: t2 of the middle link; None: equal to the barbs'
    smarticle_mass_kg: PositiveFloat
    solid_volume_m3: PositiveFloat  #: Volume of one smarticle, t1 t2 (w + 2l), each link with its own t2
    container_radius_m: PositiveFloat  #: Inner radius of the container, or of its widest tier
    #: Radius for packing fractions; None: `container_radius_m`
    packing_radius_m: PositiveFloat | None = None
    container_tiers: PositiveInt = 1  #: Number of coaxial cylinders of which the container consists
    planar: bool = False  #: Whether all motion is confined to a plane, without a container
    channel_width_m: PositiveFloat | None = None  #: Distance of the two walls in a plane; None without walls
    sphere_diameter_m: PositiveFloat
    spheres_per_smarticle: PositiveInt
    time_step_s: PositiveFloat  #: Shortest time step of all phases
    phases: tuple[Phase, ...]
    kinds: tuple[Kind, ...] | None = None  #: Kinds of bodies; None: the bodies are smarticles
    taken_over: Mapping[str, Any] | None = None  #: `Phase.origin`: the run from which smarticles were taken
    machine: str | None = None  #: Name of the machine that started the run; None: not recorded
    resumed: tuple[Start, ...] = ()  #: Later starts; the keys above describe the first one

    @model_validator(mode="after")
    def _numbered(self) -> Self:
        if [phase.index for phase in self.phases] != list(range(len(self.phases))):
            raise ValueError("'phases' must be numbered 0, 1, 2, …")
        return self

    @property
    def starts(self) -> tuple[Start, ...]:
        """All starts in order."""
        first = {name: getattr(self, name) for name in ("started", "machine", "command", "threads", "versions")}
        return (Start(**first), *self.resumed)

    @property
    def makers(self) -> tuple[Start, ...]:
        """The starts that made what is recorded: a later start replaces all from its simulated time on."""
        kept: list[Start] = []
        for start in reversed(self.starts):
            if not kept or start.time_s < kept[-1].time_s:
                kept.append(start)
        return tuple(reversed(kept))

    @property
    def made_by(self) -> dict[str, str]:
        """Versions by name of all that made the run, such as `0.2.0 (resumed by 0.3.0)`."""
        return self._of_makers(lambda start: start.versions)

    @property
    def made_on(self) -> dict[str, str]:
        """Machine and threads of all that made the run, such as `1 (resumed by 2)`."""
        return self._of_makers(
            lambda start: {**({"machine": start.machine} if start.machine else {}), "threads": str(start.threads)}
        )

    def _of_makers(self, facts: Callable[[Start], Mapping[str, str]]) -> dict[str, str]:
        each, found = [facts(start) for start in self.makers], {}
        for name in dict.fromkeys(name for one in each for name in one):
            first, *others = [value for value, _ in groupby(one.get(name, "unknown") for one in each)]
            found[name] = f"{first} (resumed by {', '.join(others)})" if others else first
        return found

    @property
    def thicknesses_in_plane_m(self) -> tuple[float, float, float]:
        """Thicknesses t2 of barb 1, middle link and barb 2 in the smarticle's plane [m]."""
        middle = self.middle_thickness_in_plane_m
        return (self.thickness_in_plane_m, middle or self.thickness_in_plane_m, self.thickness_in_plane_m)

    @property
    def bulge_m(self) -> float:
        """Half the difference of the thicknesses in the plane, middle link less barbs [m]."""
        return (self.thicknesses_in_plane_m[1] - self.thickness_in_plane_m) / 2

    @property
    def measured_radius_m(self) -> float:
        """Radius r in packing fractions [m]: `packing_radius_m` if it is given, otherwise the container's radius."""
        return self.container_radius_m if self.packing_radius_m is None else self.packing_radius_m

    def walled(self, phase: int) -> bool:
        """Return whether the container has its wall during the whole phase with index `phase`."""
        return not self.planar and all(record.type != "remove-container" for record in self.phases[: phase + 1])

    def fills_cylinder(self, phase: int) -> bool:
        """Return whether, in phase number `phase`, the pile is in a cylinder and has a packing fraction."""
        return self.container_tiers == 1 and self.walled(phase)

    def held(self, phase: int) -> bool:
        """Return whether grips or a raised hook may bear bodies in phase number `phase`.

        Grips hold until a `release` or the end of a `tension`; a hook that has been raised stays up.
        """
        types = [record.type for record in self.phases[: phase + 1]]
        grips = [kind for kind in types if kind in ("lift", "release", "tension")]
        return "pull-hook" in types or types[-1] == "tension" or grips[-1:] == ["lift"]

    def dropped(self, phase: int) -> bool:
        """Return whether bodies that grips have released may still fall in phase number `phase`."""
        before = next((record.type for record in self.phases[phase::-1] if not record.at_rest), None)
        return before in ("release", "tension") and not self.held(phase)


class Done(Document):
    """Times and cost of a run that is done: the content of `done.json`, the last file that a run writes."""

    status: Literal["done"] = "done"
    time_s: NonNegativeFloat
    steps: NonNegativeInt
    wall_s: NonNegativeFloat
    cpu_s: NonNegativeFloat | None = None
    phases: tuple[Phase, ...]

    def mark(self, out: Path) -> None:
        """Write `done.json` into a run directory, and remove `failed.json`."""
        (out / FAILED).unlink(missing_ok=True)
        self.write(out / DONE)


Ended = Literal["failed", "interrupted"]


class Failed(Document):
    """Cause of the early end of a run, `failed.json`."""

    status: Ended
    cause: str
    time_s: NonNegativeFloat  #: Simulated time
    checkpoint_s: NonNegativeFloat | None = None  #: Simulated time of the newest checkpoint; None: no checkpoint

    def mark(self, out: Path) -> None:
        """Write `failed.json` into a run directory; errors are ignored, as the terminal shows the cause too."""
        with suppress(RunError):
            self.write(out / FAILED)


class Progress(Document):
    """Progress of a running run, the content of `progress.json`, which is rewritten every second."""

    phase: str | None = None  #: Type of the current phase
    index: int | None = None  #: Number of the current phase, from 0
    phases: int | None = None  #: Number of phases of the run
    time_s: float | None = None  #: Simulated time
    end_s: float | None = None  #: Simulated time at which the current phase ends; None: unknown
    phi: float | None = None  #: Packing fraction [1]
    count: int | None = None  #: Number of smarticles added so far
    total: int | None = None  #: Number of smarticles of the scene
    fraction: float | None = None  #: Share of the run's expected work that is done [1]
    left_s: float | None = None  #: Expected wall time left
    wall_s: float | None = None  #: Wall time of the process
    checkpoint_s: float | None = None  #: Simulated time of the newest checkpoint
