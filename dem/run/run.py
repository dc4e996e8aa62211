"""Simulate one scene into a run directory, and write the manifest of the run."""

import contextlib
import logging
import os
import platform
import subprocess
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import h5py
import meshio
import numpy as np

from dem.body.kinds import Mixture
from dem.display import Display
from dem.engine.kinds import engine_kind
from dem.errors import InputError, RunError
from dem.plan.outlook import planned_phases, warnings_of
from dem.record.checkpoint import Checkpoint, has_checkpoint, read_checkpoint
from dem.record.document import HARDWARE, Done, Ended, Failed, Kind, Manifest, Phase, Start
from dem.record.files import write_text, write_whole
from dem.record.names import DONE, FAILED, MANIFEST, SCENE, VTKHDF
from dem.record.progress import PhaseCost, ProgressWriter
from dem.record.run import Run
from dem.record.rundir import Claim, claimed, log_of
from dem.record.vtkhdf import check_times
from dem.run.build import Builders
from dem.run.simulation import Simulation
from dem.run.stop import StopRequest, StopRequestedError
from dem.scene.reading import difference, dump_scene, load_scene, scene_hash
from dem.scene.scene import Scene


def run_scene(
    scene: Scene,
    out: Path,
    *,
    command: str,
    display: Display | None = None,
    resume: bool = False,
    builders: Builders | None = None,
    stop: StopRequest | None = None,
) -> Done | None:
    """Simulate a scene into a run directory; return times and cost, or None if the run was done already.

    Args:
        out: the run directory; without `resume` it must be new or empty, with `resume` it must hold a run of this
            scene.
        command: command line that started the run, for the manifest.
        display: shows the progress of the run; None: nothing does.
        resume: whether to continue from the newest undamaged checkpoint, or from the start if none was written.
        builders: functions that make the parts of the run; None: default functions.
        stop: `StopRequest` of a caller that has listened for SIGUSR1 already; if it has come, the run stops before
            its first step. None: listening begins with the simulation.

    Raises:
        InputError: `out` holds other files, or another process writes into it.
        RunError: the run failed; `failed.json` states the cause, and all files written before stay.
        StopRequestedError: SIGUSR1 came; the run stopped before its first step or at a checkpoint, and can be resumed.
        KeyboardInterrupt: the run was interrupted; all files are complete.
    """
    builders, kind = builders or Builders(), engine_kind(scene.engine)
    steps, made_by, threads = builders.steps(scene), (kind.name, kind.version()), kind.threads()
    if not resume:
        _check_ready(scene)
    saved: tuple[Checkpoint, str | None] | None = None
    with claimed(out, resume=resume) as claim:
        if resume:
            _check_scene(scene, out)
            if (out / DONE).exists():
                return None
            if not has_checkpoint(out):
                _check_ready(scene)
            else:
                # Read before anything is changed, since it may be rejected for its version.
                saved = _saved(scene, out, made_by)
        else:
            made = manifest(scene, out, steps=steps, command=command, made_by=made_by, threads=threads)
            made.write(out / MANIFEST, make_folder=True)
        if not (out / SCENE).exists():
            # A directory with a manifest counts as a run, which can be resumed if it was killed before this line.
            _keep_scene(scene, out)
        (out / FAILED).unlink(missing_ok=True)
        held = Run(out).manifest.held
        lifted = frozenset(filter(held, range(len(scene.phases))))
        with log_of(out) as log:
            bar = ProgressWriter(out, scene.count, costs=_costs(scene, steps), lifted=lifted, display=display)
            simulation: Simulation | None = None
            try:
                simulation = Simulation(
                    scene=scene,
                    engine=builders.engine(scene, min(steps)),
                    recorder=builders.recorder(scene, out, bar),
                    claim=claim,
                    log=log,
                    made_by=made_by,
                    time_steps=steps,
                    stop=stop or StopRequest(),
                )
                start = start_of(command=command, made_by=made_by, threads=threads)
                log.info("%s by %s", "resumed" if resume else "started", start.to_text())
                for warning in warnings_of(scene):
                    simulation.warn(warning)
                if resume:
                    _restore(simulation, saved, start)
                phases, engine = simulation.run(), simulation.engine
                wall, cpu = simulation.wall, simulation.cpu
                done = Done(time_s=engine.time, steps=engine.steps, wall_s=wall, cpu_s=cpu, phases=phases)
                done.mark(out)
                return done
            except (Exception, KeyboardInterrupt) as error:
                cause = _mark_ended(simulation, claim, log, error)
                if isinstance(error, RunError):
                    raise RunError(cause) from error
                raise
            finally:
                bar.finish(remove=claim.held)


def _costs(scene: Scene, steps: Sequence[float]) -> tuple[PhaseCost, ...]:
    """Return what the phases of a scene are expected to cost."""
    return tuple(
        PhaseCost(
            simulated_s=planned.estimate_s,
            wall_s=planned.wall_s,
            known=planned.duration_s is not None,
            grows=phase.pours,
        )
        for planned, phase in zip(planned_phases(scene, steps), scene.phases, strict=True)
    )


def _check_ready(scene: Scene) -> None:
    for phase in scene.phases:
        phase.ready(scene)


def _keep_scene(scene: Scene, out: Path) -> None:
    for name, content in filter(None, (phase.attached for phase in scene.phases)):
        write_whole(out / name, partial(Path.write_bytes, data=content))
    write_text(out / SCENE, dump_scene(scene, out, attached=True))


def _check_scene(scene: Scene, out: Path) -> None:
    recorded_hash = Run(out).manifest.scene_sha256
    if recorded_hash == scene_hash(scene):
        return
    try:
        recorded = load_scene(out / SCENE)
    except InputError:
        recorded = None
    if recorded is None or scene_hash(recorded) != recorded_hash:
        raise InputError(
            f"--out {out}: {out / SCENE} is not the scene that this run was made from (its hash is not the "
            f"{recorded_hash[:12]} of {MANIFEST}); put it back as it was, or run it in another directory"
        )
    raise InputError(
        f"--out {out}: was made from another scene: {difference(recorded, scene)}; resume with {out / SCENE} and no "
        "--set, or run the changed scene in another directory"
    )


def _saved(scene: Scene, out: Path, made_by: tuple[str, str]) -> tuple[Checkpoint, str | None]:
    checkpoint, warning = read_checkpoint(out, scene_sha256=scene_hash(scene), made_by=made_by)
    if scene.recording.frames == "vtkhdf":
        with _of_checkpoint(out):
            check_times(out / VTKHDF, checkpoint.state["recorder"]["frames"])
    return checkpoint, warning


@contextlib.contextmanager
def _of_checkpoint(out: Path) -> Iterator[None]:
    """Context manager for code that uses a checkpoint: replace any unexpected error by an InputError.

    An InputError or RunError is passed on.
    """
    try:
        yield
    except (InputError, RunError):
        raise
    # Such content can fail anywhere.
    except Exception as error:
        msg = f"{out}: cannot be resumed, its checkpoint has other content than the run needs ({error!r}); start anew"
        raise InputError(msg) from error


def _restore(simulation: Simulation, saved: tuple[Checkpoint, str | None] | None, start: Start) -> None:
    out, log = simulation.folder, simulation.log
    if saved is None:
        log.info("resumed from the start: no checkpoint was written")
        simulation.recorder.truncate({})
        _note_start(out, start)
        return
    checkpoint, warning = saved
    if warning:
        simulation.warn(warning)
    with _of_checkpoint(out):
        simulation.restore(checkpoint)
    changes = _note_start(out, start.model_copy(update={"time_s": simulation.engine.time}))
    if changes:
        simulation.warn(
            f"resumed with {', '.join(changes)}; it continues, but results may differ from those of a run that was "
            "never stopped"
        )
    log.info("resumed from the checkpoint of t = %.4f s", simulation.engine.time)


def _note_start(out: Path, start: Start) -> list[str]:
    """Add a start to the manifest; return what of software and threads differs from the start that it continues."""
    manifest = Run(out).manifest
    manifest = manifest.model_copy(update={"resumed": (*manifest.resumed, start)})
    manifest.write(out / MANIFEST)
    if len(manifest.makers) < 2:
        return []
    workers = engine_kind(manifest.engine).workers
    then, now = (
        {name: number for name, number in one.versions.items() if name not in HARDWARE}
        | {f"--{workers}": str(one.threads)}
        for one in manifest.makers[-2:]
    )
    names = [name for name in {**then, **now} if then.get(name) != now.get(name)]
    return [f"{name} {now.get(name, 'unknown')} instead of {then.get(name, 'unknown')}" for name in names]


def _mark_ended(simulation: Simulation | None, claim: Claim, log: logging.Logger, error: BaseException) -> str:
    """Write the series and `failed.json` after an error has ended a run; return the cause in words.

    If the run failed, rather than being interrupted, the text ends with the time of the last checkpoint.
    `simulation` is None if the error came before it was built. Nothing is written if the directory was moved.
    """
    status: Ended = "interrupted" if isinstance(error, StopRequestedError | KeyboardInterrupt) else "failed"
    cause = "interrupted by the user" if isinstance(error, KeyboardInterrupt) else str(error)
    if not isinstance(error, InputError | RunError | StopRequestedError | KeyboardInterrupt):
        # A bug in this program: the run directory must still state that the run has ended.
        log.error("unexpected error", exc_info=error)
        cause = f"unexpected {type(error).__name__}: {error}"
    time, checkpoint = 0.0, None
    if simulation is not None:
        # Without samples this process has resumed nothing, and the series of the earlier one must stay.
        if simulation.recorder.samples and claim.held:
            with contextlib.suppress(RunError):  # a full disk: what was written before is whole
                simulation.recorder.series.write()
        time, checkpoint = simulation.engine.time, simulation.checkpointed
        if status == "failed":
            good = "none" if checkpoint is None else f"t = {checkpoint:.4f} s"
            cause = f"{cause} (last good checkpoint: {good})"
    log.error("%s", cause)
    if claim.held:
        Failed(status=status, cause=cause, time_s=time, checkpoint_s=checkpoint).mark(claim.out)
    return cause


def manifest(
    scene: Scene, out: Path, *, steps: Sequence[float], command: str, made_by: tuple[str, str], threads: int
) -> Manifest:
    """Return the manifest of a run: how it was made, and the numbers of the scene that measures need.

    `steps` are the time steps of each phase [s], `made_by` name and version of the engine.
    """
    model, origin = scene.model, scene.phases[0].origin(scene)
    boxes = None if isinstance(model, Mixture) else model.boxes
    start = start_of(command=command, made_by=made_by, threads=threads)
    if origin is not None:  # a relative path stays right if both runs are moved together
        origin = {**origin, "run": os.path.relpath(origin["run"], out.resolve())}
    return Manifest(
        name=scene.name,
        scene_sha256=scene_hash(scene),
        seed=scene.seed,
        command=command,
        started=start.started,
        versions=start.versions,
        engine=scene.engine,
        threads=threads,
        fidelity=scene.fidelity.base,
        count=scene.count,
        aspect_ratio=0.0 if boxes is None else scene.smarticle.aspect_ratio,
        middle_length_m=model.size,
        barb_length_m=0.0 if boxes is None else boxes.barb_length,
        thickness_normal_m=model.thicknesses[0],
        thickness_in_plane_m=model.thicknesses[1],
        middle_thickness_in_plane_m=None if boxes is None else boxes.middle_thickness_in_plane,
        smarticle_mass_kg=model.mass,
        solid_volume_m3=model.volume,
        container_radius_m=scene.container.radius_m,
        packing_radius_m=scene.container.packing_radius_m,
        container_tiers=1 + len(scene.cylinder.upper),
        sphere_diameter_m=model.diameter,
        spheres_per_smarticle=max(len(body.centres) for body in scene.bodies),
        time_step_s=min(steps),
        phases=tuple(
            Phase(index=k, type=phase.kind, at_rest=phase.at_rest, time_step_s=dt)
            for k, (phase, dt) in enumerate(zip(scene.phases, steps, strict=True))
        ),
        planar=scene.plane is not None,
        channel_width_m=None if scene.plane is None else scene.plane.width_m,
        kinds=None if scene.mixture is None else kinds_of(scene.mixture),
        taken_over=origin,
        machine=start.machine,
    )


def start_of(*, command: str, made_by: tuple[str, str], threads: int) -> Start:
    """Return the present start of a run; `made_by` are name and version of the engine."""
    return Start(
        started=datetime.now(UTC).isoformat(timespec="seconds"),
        machine=platform.node() or None,
        command=command,
        threads=threads,
        versions=versions(made_by),
    )


def kinds_of(mixture: Mixture) -> tuple[Kind, ...]:
    """Return the kinds of a mixture as manifests have them."""
    numbers = np.bincount(mixture.of, minlength=len(mixture.kinds))
    return tuple(
        Kind(
            shape=kind.name,
            bodies=int(number),
            bars=len(kind.bars.points),
            mass_kg=kind.mass,
            volume_m3=kind.volume,
            length_m=kind.length,
            thickness_normal_m=kind.bars.thickness_normal,
            thickness_in_plane_m=kind.bars.thickness_in_plane,
            round=kind.bars.round,
            sphere_diameter_m=kind.diameter,
        )
        for kind, number in zip(mixture.kinds, numbers, strict=True)
    )


def versions(made_by: tuple[str, str]) -> dict[str, str]:
    """Return the versions of all software on which results depend; `made_by`: engine and its version."""
    try:
        own = version("smarticles")
    except PackageNotFoundError:
        own = "not installed"
    return {
        "smarticles": own,
        "git": _git_revision(),
        made_by[0]: made_by[1],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "h5py": h5py.__version__,
        "meshio": meshio.__version__,
        "processor": _processor(),
        "blas": _blas(),
    }


def _processor() -> str:
    """Return the model of the processor, for the manifest."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def _blas() -> str:
    """Return name, version and kernels of NumPy's BLAS, for the manifest.

    The results of the engine links do not depend on it.
    """
    built = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    forced = os.environ.get("OPENBLAS_CORETYPE", "")
    return f"{built.get('name')} {built.get('version')}, kernels {forced or 'by the processor'}"


def _git_revision() -> str:
    """Return the commit of the code, with `-dirty` for changed files; `unknown` outside a checkout."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        answer = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return answer.stdout.strip() or "unknown"
