"""What a run directory says about its run: `run.json` with `done.json` or `failed.json`, written and read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from dem.errors import RunError
from dem.record.document import REMEDY, Document
from dem.record.files import cannot_read, write_json
from dem.record.names import DONE, FAILED, MANIFEST, MANIFEST_FORMAT, OF_SWEEP


@dataclass(frozen=True, kw_only=True)
class PhaseRecord:
    """One phase of a run.

    Attributes:
        index: Position in the run, as in `Frame.phase`.
        type: Name of the kind of phase, e.g. "deposit", "relax", "shake".
        time_step: Of the integration [s]; None where the manifest does not say.
        start: Simulated time at which it began [s]; None unless the run is done.
        end: Simulated time at which it ended [s]; None unless the run is done.
        wall_time: Wall time it took [s]; None unless the run is done.
        cpu_time: Processor time it took [s]; None unless the run is done and says so.
    """

    index: int
    type: str
    time_step: float | None = None
    start: float | None = None
    end: float | None = None
    wall_time: float | None = None
    cpu_time: float | None = None


@dataclass(frozen=True, kw_only=True)
class RunManifest:
    """What made a run and how it ended.

    Attributes:
        directory: The run directory.
        name: Name of the scene.
        scene_sha256: Hash of the resolved scene.
        seed: Seed of all random numbers.
        command: Command line of the run.
        started: Wall-clock start, ISO 8601.
        versions: Version of each program that took part.
        threads: Threads the engine ran with; ranks on lammps.
        fidelity: Name of the fidelity setting.
        count: Number of smarticles of the scene.
        aspect_ratio: Barb length over middle length, l/w [-].
        middle_length: w [m].
        barb_length: l [m].
        thickness_normal: Thickness t1 along the normal of the smarticle's plane [m].
        thickness_in_plane: Thickness t2 in the smarticle's plane [m].
        middle_thickness_in_plane: That of the middle link, where it has its own [m]; None otherwise.
        smarticle_mass: Mass of one smarticle [kg].
        solid_volume: Volume of one smarticle, t1 t2 (w + 2l), each link with its own t2 [m³].
        container_radius: [m]; of the widest tier.
        packing_radius: That packing fractions are computed with [m], where it is not the container's; None otherwise.
        container_tiers: Cylinders of different radii that stand on each other.
        planar: Whether all motion is confined to a plane, without a container.
        channel_width: Distance of the two walls in the plane [m]; None without.
        sphere_diameter: Diameter of the spheres that stand for a smarticle [m].
        spheres_per_smarticle: Number of those spheres.
        time_step: The shortest of its phases [s].
        phases: The phases in order.
        status: "done", "failed", "interrupted" or "unfinished".
        engine: What computed it: "yade", "links" or "lammps".
        cause: Why the run failed or was interrupted; None otherwise.
        end_time: Simulated time at which the run ended [s]; None while unfinished.
        steps: Time steps of a done run; None otherwise.
        wall_time: Wall time of a done run [s]; None otherwise.
        processor_time: Processor time of a done run [s]; None otherwise, and where it was not told yet.
        taken_over: Where its smarticles come from, if from another run, see ARCHITECTURE.md; None otherwise.
    """

    directory: Path
    name: str
    scene_sha256: str
    seed: int
    command: str
    started: str
    versions: Mapping[str, str]
    threads: int
    fidelity: str
    count: int
    aspect_ratio: float
    middle_length: float
    barb_length: float
    thickness_normal: float
    thickness_in_plane: float
    smarticle_mass: float
    solid_volume: float
    container_radius: float
    sphere_diameter: float
    spheres_per_smarticle: int
    time_step: float
    phases: tuple[PhaseRecord, ...]
    status: str
    middle_thickness_in_plane: float | None = None
    packing_radius: float | None = None
    container_tiers: int = 1
    planar: bool = False
    channel_width: float | None = None
    engine: str = "yade"
    cause: str | None = None
    end_time: float | None = None
    steps: int | None = None
    wall_time: float | None = None
    processor_time: float | None = None
    taken_over: Mapping[str, Any] | None = None

    @property
    def thicknesses_in_plane(self) -> tuple[float, float, float]:
        """Of barb 1, middle link, barb 2 [m]."""
        middle = self.middle_thickness_in_plane
        return (self.thickness_in_plane, middle or self.thickness_in_plane, self.thickness_in_plane)

    @property
    def bulge(self) -> float:
        """By how much the middle link is thicker than the barbs, to either side in the plane [m]."""
        return (self.thicknesses_in_plane[1] - self.thickness_in_plane) / 2

    @property
    def measured_radius(self) -> float:
        """Radius that packing fractions are computed with [m]."""
        return self.container_radius if self.packing_radius is None else self.packing_radius

    def walled(self, phase: int) -> bool:
        """Whether the container's wall is there in the phase of an index."""
        return not self.planar and all(record.type != "remove-container" for record in self.phases[: phase + 1])

    def fills_cylinder(self, phase: int) -> bool:
        """Whether the pile fills one cylinder then, so that packing fractions have a meaning."""
        return self.container_tiers == 1 and self.walled(phase)


def manifest_data(run: RunManifest) -> dict[str, Any]:
    """The content of `run.json`: what made a run; how it ended is in another file."""
    plane = {"planar": True, "channel_width_m": run.channel_width} if run.planar else {}
    middle = {} if (own := run.middle_thickness_in_plane) is None else {"middle_thickness_in_plane_m": own}
    measured = {} if run.packing_radius is None else {"packing_radius_m": run.packing_radius}
    return {
        "format": MANIFEST_FORMAT,
        "name": run.name,
        "scene_sha256": run.scene_sha256,
        "seed": run.seed,
        "command": run.command,
        "started": run.started,
        "versions": dict(run.versions),
        "engine": run.engine,
        "threads": run.threads,
        "fidelity": run.fidelity,
        "count": run.count,
        "aspect_ratio": run.aspect_ratio,
        "middle_length_m": run.middle_length,
        "barb_length_m": run.barb_length,
        "thickness_normal_m": run.thickness_normal,
        "thickness_in_plane_m": run.thickness_in_plane,
        **middle,
        "smarticle_mass_kg": run.smarticle_mass,
        "solid_volume_m3": run.solid_volume,
        "container_radius_m": run.container_radius,
        **measured,
        "container_tiers": run.container_tiers,
        "sphere_diameter_m": run.sphere_diameter,
        "spheres_per_smarticle": run.spheres_per_smarticle,
        "time_step_s": run.time_step,
        "phases": [{"index": phase.index, "type": phase.type, "time_step_s": phase.time_step} for phase in run.phases],
        **plane,
        **({} if run.taken_over is None else {"taken_over": dict(run.taken_over)}),
    }


def write_manifest(run: RunManifest) -> None:
    """Write `run.json` into the directory of a run.

    Raises:
        RunError: it cannot be written.
    """
    write_json(run.directory / MANIFEST, manifest_data(run))


def mark_done(
    out: Path, *, time: float, steps: int, wall: float, cpu: float, phases: Sequence[Mapping[str, Any]]
) -> None:
    """Write `done.json`, the last file of a run.

    Args:
        out: the run directory.
        time: simulated time at the end [s].
        steps: made in all.
        wall: wall time spent [s].
        cpu: processor time spent [s].
        phases: of each `index`, `type`, `start_s`, `end_s`, `wall_s`, `cpu_s`.

    Raises:
        RunError: it cannot be written.
    """
    (out / FAILED).unlink(missing_ok=True)
    data = {"status": "done", "time_s": time, "steps": steps, "wall_s": wall, "cpu_s": cpu, "phases": list(phases)}
    write_json(out / DONE, data, make_folder=False)


def mark_failed(out: Path, *, status: str, cause: str, time: float, checkpoint: float | None) -> None:
    """Write `failed.json`; silent where the disk is full, since the cause is on the terminal too.

    Args:
        out: the run directory.
        status: "failed" or "interrupted".
        cause: why.
        time: simulated time that the run came to [s].
        checkpoint: simulated time of the last good checkpoint [s]; None: there is none.
    """
    try:
        data = {"status": status, "cause": cause, "time_s": time, "checkpoint_s": checkpoint}
        write_json(out / FAILED, data, make_folder=False)
    except RunError:
        return


def read_run(directory: Path | str) -> RunManifest:
    """Reads what a run directory says about its run.

    Args:
        directory: A run directory; the run may be done, failed or still going on.

    Returns:
        The manifest.

    Raises:
        InputError: The directory or its manifest is missing, damaged or of another format.

    Source:
        ARCHITECTURE.md, "The run directory".

    Example:
        >>> read_run("runs/pile").status
        'done'
    """
    directory = Path(directory)
    if not (directory / MANIFEST).is_file():
        _refuse_place(directory)
    run = Document.read(directory / MANIFEST)
    if run.data.get("format") != MANIFEST_FORMAT:
        found = run.data.get("format")
        cannot_read("manifest", run.path, f"'format' must be {MANIFEST_FORMAT}: got {found!r}", REMEDY)
    versions = run.data.get("versions", {})
    if not isinstance(versions, dict):
        cannot_read("manifest", run.path, "'versions' must be an object", REMEDY)
    phases = tuple(
        PhaseRecord(
            index=phase.integer("index"),
            type=phase.text("type"),
            # Runs of before each phase had its own do not say.
            time_step=phase.number("time_step_s", positive=True) if phase.data.get("time_step_s") else None,
        )
        for phase in run.phases()
    )
    if [phase.index for phase in phases] != list(range(len(phases))):
        cannot_read("manifest", run.path, "'phases' must be numbered 0, 1, 2, …", REMEDY)
    return RunManifest(
        directory=directory,
        name=run.text("name"),
        scene_sha256=run.text("scene_sha256"),
        seed=run.integer("seed"),
        command=run.text("command"),
        started=run.text("started"),
        versions=MappingProxyType({str(key): str(value) for key, value in versions.items()}),
        threads=run.integer("threads"),
        fidelity=run.text("fidelity"),
        count=run.integer("count", least=1),
        aspect_ratio=run.number("aspect_ratio"),
        middle_length=run.number("middle_length_m", positive=True),
        barb_length=run.number("barb_length_m"),
        thickness_normal=run.number("thickness_normal_m", positive=True),
        thickness_in_plane=run.number("thickness_in_plane_m", positive=True),
        middle_thickness_in_plane=run.number("middle_thickness_in_plane_m", positive=True)
        if "middle_thickness_in_plane_m" in run.data
        else None,
        smarticle_mass=run.number("smarticle_mass_kg", positive=True),
        solid_volume=run.number("solid_volume_m3", positive=True),
        container_radius=run.number("container_radius_m", positive=True),
        packing_radius=run.number("packing_radius_m", positive=True) if "packing_radius_m" in run.data else None,
        # Runs of before there were tiers do not say.
        container_tiers=run.integer("container_tiers", least=1) if "container_tiers" in run.data else 1,
        planar=run.data.get("planar") is True,
        channel_width=run.number("channel_width_m", positive=True) if run.data.get("channel_width_m") else None,
        # Runs of before there was another engine do not say.
        engine=run.text("engine") if "engine" in run.data else _first_engine(versions),
        sphere_diameter=run.number("sphere_diameter_m", positive=True),
        spheres_per_smarticle=run.integer("spheres_per_smarticle", least=1),
        time_step=run.number("time_step_s", positive=True),
        taken_over=run.data.get("taken_over"),
        **_ending(directory, phases),
    )


def _refuse_place(directory: Path) -> NoReturn:
    """Say what is there instead of a run."""
    if not directory.exists():
        cause, remedy = "no such directory", REMEDY
    elif not directory.is_dir():
        cause, remedy = "it is a file", REMEDY
    elif (directory / OF_SWEEP).is_file():
        cause, remedy = "it is a sweep", f"give one of its runs, {directory / 'runs' / 'NAME'}"
    else:
        cause, remedy = f"it holds no {MANIFEST}", REMEDY
    cannot_read("run directory", directory, cause, remedy)


def _first_engine(versions: Mapping[str, Any]) -> str:
    """The engine of a run that does not say, by the versions that it lists."""
    return "links" if "links" in versions else "yade"


def _ending(directory: Path, phases: tuple[PhaseRecord, ...]) -> dict[str, Any]:
    """The fields that depend on whether and how the run ended."""
    # done.json first: a resumed run may have left an older failed.json behind.
    if (directory / DONE).exists():
        done = Document.read(directory / DONE)
        return {
            "phases": _timed(phases, done),
            "status": "done",
            "end_time": done.number("time_s"),
            "steps": done.integer("steps"),
            "wall_time": done.number("wall_s"),
            "processor_time": done.number("cpu_s") if "cpu_s" in done.data else None,
        }
    if (directory / FAILED).exists():
        failed = Document.read(directory / FAILED)
        return {
            "phases": phases,
            "status": failed.text("status"),
            "cause": failed.text("cause"),
            "end_time": failed.number("time_s"),
        }
    return {"phases": phases, "status": "unfinished"}


def _timed(planned: tuple[PhaseRecord, ...], done: Document) -> tuple[PhaseRecord, ...]:
    timed = tuple(
        PhaseRecord(
            index=phase.integer("index"),
            type=phase.text("type"),
            time_step=planned[k].time_step if k < len(planned) else None,
            start=phase.number("start_s"),
            end=phase.number("end_s"),
            wall_time=phase.number("wall_s"),
            # Runs of before it was measured do not say.
            cpu_time=phase.number("cpu_s") if "cpu_s" in phase.data else None,
        )
        for k, phase in enumerate(done.phases())
    )
    if [(phase.index, phase.type) for phase in timed] != [(phase.index, phase.type) for phase in planned]:
        cause = f"its phases differ from those of run.json: {[phase.type for phase in timed]}"
        cannot_read("manifest", done.path, cause, REMEDY)
    return timed
