"""One run: a scene in, a run directory out."""

from __future__ import annotations

import logging
import platform
import subprocess
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np

from dem.engine import Cylinder, Engine, yade_version
from dem.errors import InputError, RunError
from dem.files import write_json, write_text
from dem.frames import FrameWriter
from dem.parts import Shake
from dem.phases import Clock, container_height, perform, shake_amplitude
from dem.progress import Progress
from dem.recorder import Recorder
from dem.scene import Scene, dump_scene, scene_hash
from dem.series import SeriesWriter
from dem.timestep import contact_law, time_step
from dem.watchdog import Watchdog

FORMAT = 1
SPEED_MARGIN = 5.0  # times the speed of a fall over the container's height, or of the shaking


@dataclass(frozen=True)
class RunOutcome:
    """A finished run.

    Args:
        folder: the run directory.
        time_s: simulated time [s].
        steps: steps made.
        wall_s: wall time [s].
    """

    folder: Path
    time_s: float
    steps: int
    wall_s: float


def run_scene(scene: Scene, out: Path, *, command: str, progress: bool) -> RunOutcome:
    """Run a scene into a new run directory.

    Args:
        scene: what to run.
        out: the run directory; must not exist, or be empty.
        command: the command line, for the manifest.
        progress: whether to draw progress on standard error.

    Raises:
        InputError: `out` holds something already.
        RunError: the run failed; `failed.json` tells the cause and everything recorded before stays.
        KeyboardInterrupt: the run was interrupted; `failed.json` says so and what was recorded is whole.
    """
    dt = time_step(scene)
    version_of_yade = yade_version()
    _claim(out)
    write_text(out / "scene.yaml", dump_scene(scene))
    write_json(out / "run.json", manifest(scene, dt=dt, command=command, yade=version_of_yade))
    log = _open_log(out)
    bar = Progress(out, scene.count, show=progress)
    begun = time.monotonic()
    engine: Engine | None = None
    recorder: Recorder | None = None
    try:
        engine = _build_engine(scene, dt)
        recorder = _build_recorder(scene, engine, out, bar)
        phases = _perform_all(scene, engine, recorder, log)
        recorder.series.write()
    except (RunError, KeyboardInterrupt) as error:
        interrupted = isinstance(error, KeyboardInterrupt)
        cause = "interrupted by the user" if interrupted else str(error)
        log.error("%s", cause)
        _leave_usable(out, recorder, engine, status="interrupted" if interrupted else "failed", cause=cause)
        raise
    finally:
        bar.finish()
        for handler in log.handlers:
            handler.close()
        log.handlers.clear()
    wall = time.monotonic() - begun
    done = {
        "status": "done",
        "time_s": engine.time,
        "steps": engine.steps,
        "wall_s": wall,
        "phases": phases,
    }
    write_json(out / "done.json", done)
    return RunOutcome(out, engine.time, engine.steps, wall)


def manifest(scene: Scene, *, dt: float, command: str, yade: str) -> dict[str, Any]:
    """The content of `run.json`: what made the run, and the numbers that measures need."""
    particle, boxes = scene.particle, scene.smarticle.boxes
    return {
        "format": FORMAT,
        "name": scene.name,
        "scene_sha256": scene_hash(scene),
        "seed": scene.seed,
        "command": command,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": {
            "smarticles": _own_version(),
            "git": _git_revision(),
            "yade": yade,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "h5py": h5py.__version__,
            "meshio": meshio.__version__,
        },
        "threads": 1,
        "fidelity": scene.fidelity.base,
        "count": scene.count,
        "aspect_ratio": scene.smarticle.aspect_ratio,
        "middle_length_m": boxes.middle_length,
        "barb_length_m": boxes.barb_length,
        "thickness_normal_m": boxes.thickness_normal,
        "thickness_in_plane_m": boxes.thickness_in_plane,
        "smarticle_mass_kg": boxes.mass,
        "solid_volume_m3": boxes.volume,
        "container_radius_m": scene.container.radius_m,
        "sphere_diameter_m": particle.chain.diameter,
        "spheres_per_smarticle": len(particle.centres),
        "time_step_s": dt,
        "phases": [{"index": k, "type": phase.type} for k, phase in enumerate(scene.phases)],
    }


def _claim(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        held = next(out.iterdir(), None)
    except OSError as error:
        msg = f"--out {out}: cannot be made ({error.strerror}); choose another directory"
        raise InputError(msg) from None
    if held is not None:
        what = "another run" if (out / "run.json").exists() else f"files ({held.name}, …)"
        msg = f"--out {out}: holds {what} and is left as it is; choose another directory"
        raise InputError(msg)


def _build_engine(scene: Scene, dt: float) -> Engine:
    cylinder = Cylinder(
        radius=scene.container.radius_m,
        height=container_height(scene),
        facets=scene.fidelity.wall_facets,
    )
    return Engine(
        particle=scene.particle,
        cylinder=cylinder,
        law=contact_law(scene),
        gravity=scene.gravity_m_per_s2,
        time_step=dt,
        shaken=any(isinstance(phase, Shake) for phase in scene.phases),
    )


def _build_recorder(scene: Scene, engine: Engine, out: Path, progress: Progress) -> Recorder:
    radius, gravity, dt = scene.container.radius_m, scene.gravity_m_per_s2, engine.time_step
    height = container_height(scene)
    fall = (2 * gravity * height) ** 0.5
    shaking = max(
        (
            shake_amplitude(phase, gravity) * 2 * np.pi * phase.frequency_hz
            for phase in scene.phases
            if isinstance(phase, Shake)
        ),
        default=0.0,
    )
    return Recorder(
        series=SeriesWriter(out, radius, gravity, {"scene_sha256": scene_hash(scene), "seed": scene.seed}),
        frames=FrameWriter(out),
        watchdog=Watchdog(radius=radius, height=height, speed=SPEED_MARGIN * max(fall, shaking)),
        progress=progress,
        series_steps=round(scene.recording.series_interval_s / dt),
        frame_steps=round(scene.recording.frame_interval_s / dt),
    )


def _perform_all(scene: Scene, engine: Engine, recorder: Recorder, log: logging.Logger) -> list[dict[str, Any]]:
    performed = []
    for index, phase in enumerate(scene.phases):
        start, wall = engine.time, time.monotonic()
        duration = getattr(phase, "duration_s", None)
        end = start + duration if duration is not None else None
        recorder.progress.begin(index=index, phase=phase.type, start=start, end=end)
        log.info("phase %d %s begins at t = %.4f s", index, phase.type, start)

        def advance(seconds: float, index: int = index) -> None:
            target = engine.steps + max(1, round(seconds / engine.time_step))
            while engine.steps < target:
                engine.advance(min(target, recorder.next_step) - engine.steps)
                if engine.steps == recorder.next_step:
                    recorder.record(engine, index)

        if recorder.next_step == 0:
            recorder.record(engine, index)
        perform(phase, scene, Clock(engine, advance))
        spent = time.monotonic() - wall
        log.info(
            "phase %d %s ended at t = %.4f s after %.1f s of wall time",
            index,
            phase.type,
            engine.time,
            spent,
        )
        performed.append(
            {
                "index": index,
                "type": phase.type,
                "start_s": start,
                "end_s": engine.time,
                "wall_s": spent,
            }
        )
    return performed


def _leave_usable(out: Path, recorder: Recorder | None, engine: Engine | None, *, status: str, cause: str) -> None:
    try:
        if recorder is not None:
            recorder.series.write()
        write_json(
            out / "failed.json",
            {
                "status": status,
                "cause": cause,
                "time_s": engine.time if engine is not None else 0.0,
            },
        )
    except RunError:
        # The disk is full: the cause is on the terminal, and what was written before is whole.
        return


def _open_log(out: Path) -> logging.Logger:
    log = logging.getLogger(f"smarticles.{out.resolve()}")
    log.setLevel(logging.INFO)
    log.propagate = False
    handler = logging.FileHandler(out / "log.txt", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    return log


def _own_version() -> str:
    try:
        return version("smarticles")
    except PackageNotFoundError:
        return "not installed"


def _git_revision() -> str:
    """Commit of the code, with `-dirty` where files differ from it; `unknown` outside a checkout."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        answer = subprocess.run(
            command,
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
            timeout=10,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return answer.stdout.strip() or "unknown"
