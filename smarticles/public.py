"""Python API: run and read scenes and sweeps, and measure them."""

from __future__ import annotations

import re
import shlex
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import pandas as pd
import yaml

from dem.display import Display
from dem.errors import InputError, RunError
from dem.record.frame import Frame
from dem.record.names import SCENE
from dem.record.progress import row_of
from dem.record.run import Run, open_run
from dem.scene.reading import SCHEMA_VERSION, dump_scene
from dem.scene.scene import Scene
from dem.scene.stiffness import stiffness_for
from dem.setting.contact import PRESET
from dem.yaml_text import load_yaml, read_text
from postprocess.measures.registry import FrameMeasure, measure_of
from smarticles.main import BAD_INPUT
from smarticles.measuring import grouped, measured, states
from smarticles.sweeps import compute, make_folder, raise_failures
from templates.local import environment, smarticles_command
from templates.sweep.folder import Folder, open_folder
from templates.sweep.from_scene import as_template
from templates.sweep.sweep_file import SEED

if TYPE_CHECKING:
    from PIL.Image import Image

#: A measure, or a function of a frame and its run, whose name ends with the unit of its value: `top_m`
OwnMeasure = FrameMeasure | Callable[[Frame, Run], float]

# Options of the command line and keys of `vary`, as messages name them, and what Python calls them.
_IN_PYTHON = (
    (r"--resume\b", "resume=True"),
    (r"--(threads|ranks|jobs) (\d+)", r"\1=\2"),
    (r"--(out|threads|ranks|jobs)\b", r"\1"),
    (r"--set ([\w.]+)='\{\{ \w+ \}\}'", r"vary: \1"),
    (r"smarticles-\w+/scene\.yaml\.j2, rendered for run", "vary: run"),
    (r"smarticles-\w+/sweep\.yaml", "vary"),
    (r"smarticles-\w+/scene\.yaml(\.j2)?", "scene"),
)


_POLL_S = 0.25  # between two readings of the progress of a run


@dataclass(frozen=True)
class SweepDirectory(Sequence[Run]):
    """Directory of a sweep: a sequence of its runs, and tables of their measures."""

    folder: Folder  #: Manifest and entries of the sweep

    @property
    def path(self) -> Path:
        """Path of the directory."""
        return self.folder.path

    @cached_property
    def values(self) -> pd.DataFrame:
        """Values of the sweep's variables and constants: one row per run, indexed by the runs' names."""
        entries = self.folder.entries
        return pd.DataFrame([dict(entry.values) for entry in entries], index=[entry.name for entry in entries])

    def __len__(self) -> int:
        return len(self.folder.entries)

    @overload
    def __getitem__(self, index: int) -> Run: ...
    @overload
    def __getitem__(self, index: slice) -> list[Run]: ...
    def __getitem__(self, index: int | slice) -> Run | list[Run]:
        return self.folder.runs()[index]

    def table(
        self,
        *,
        by: str | Sequence[str] | None = None,
        unfinished: bool = False,
        frames: bool = False,
        measures: Sequence[OwnMeasure] = (),
        jobs: int = 1,
    ) -> pd.DataFrame:
        """Return the measures of all runs that have frames, with the sweep's variables as columns.

        Args:
            by: columns, such as variables of the sweep. The result is then averaged over finished runs with equal
                values in these columns; columns "… SE […]" have the standard errors over runs. The column `state`
                states how many runs of a group are finished.
            unfinished: with `by`, average over unfinished runs too.
            frames: return one row per frame; cannot be combined with `by`.
            measures: further measures; a function of a frame and its run returns a number.
            jobs: number of processes. More than 1 needs `if __name__ == "__main__":` in the calling script.

        Returns:
            One row per run and phase, per group and phase with `by`, or per frame. Column names contain the units.

        Raises:
            InputError: no run has frames yet, a column does not exist, `by` and `frames` are combined, or `unfinished`
                is given without `by`.
        """
        if unfinished and by is None:
            raise InputError(
                "unfinished: is for means over runs; give by, or leave it out: without by all runs are listed"
            )
        if by is not None and frames:
            raise InputError("by: averages over phases of runs; leave frames out")
        table = measured([self.path], frames=frames, measures=[measure_of(one) for one in measures], jobs=jobs)
        if by is None:
            return table
        names = [by] if isinstance(by, str) else list(by)
        return grouped(table, names, runs=states([self.path]), unfinished=unfinished)


def run(
    scene: Scene | Path | str,
    out: Path | str,
    *,
    threads: int = 1,
    ranks: int | None = None,
    resume: bool = False,
    progress: bool = True,
) -> Run:
    """Run a scene in a new process, as `smarticles run` does, and return the finished run.

    A new process is needed because YADE and PyVista must not be loaded in one process.

    Args:
        scene: scene, or path of a scene file.
        out: run directory. It must be absent or empty; with `resume` it may hold an unfinished run of this scene.
        threads: number of threads of YADE. Results are reproducible bit by bit with one thread only.
        ranks: number of MPI processes of LAMMPS; None: 1, or with `resume` the number at the start.
        resume: continue an unfinished run from its last checkpoint.
        progress: show a bar on the terminal or in the notebook; elsewhere a line every 30 s.

    Raises:
        InputError: the scene is not valid, or `out` contains other files.
        RunError: the run failed or was stopped.
        KeyboardInterrupt: Ctrl-C stopped the run; all its files are complete.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch, _in_words_of_python(scratch):
        file = Path(scratch, "scene.yaml") if isinstance(scene, Scene) else Path(scene)
        if isinstance(scene, Scene):
            file.write_text(dump_scene(scene), encoding="utf-8")
        words = [*smarticles_command(file, Path(out), resume), "--threads", str(threads)]
        words += [] if ranks is None else ["--ranks", str(ranks)]
        if isinstance(scene, Scene):
            # The file in the temporary folder will not exist; `scene.yaml` in the run directory will.
            words += ["--recorded-as", shlex.join(["smarticles", "run", str(Path(out) / SCENE), "--out", "NEW"])]
        with Path(scratch, "said").open("w+", encoding="utf-8") as said:
            # In a session of its own: Ctrl-C reaches this process alone, which signals the run once.
            process = subprocess.Popen(
                words, env=environment(), stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
            )
            status = _wait(process, Path(out), progress=progress)
            said.seek(0)
            lines = [line for line in said.read().splitlines() if line.startswith("smarticles: ")]
        if status:
            lines = lines or [f"exit status {status}, without a message"]
            text = lines[-1].removeprefix("smarticles: ").removeprefix("error: ")
            raise InputError(text) if status == BAD_INPUT else RunError(text)
    return Run(Path(out))


def _wait(process: subprocess.Popen[bytes], out: Path, *, progress: bool) -> int:
    """Wait for the process of a run and return its exit status; show the progress in the run directory `out`.

    After Ctrl-C, the run closes its files before KeyboardInterrupt is raised; Ctrl-C again kills it.
    """
    with Display() if progress else nullcontext() as display:
        try:
            while True:
                if display is not None:
                    display.update(row_of(Run(out).progress))
                with suppress(subprocess.TimeoutExpired):
                    return process.wait(_POLL_S)
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.wait()
            raise KeyboardInterrupt(f"{out}: stopped; go on with smarticles.run(…, resume=True)") from None
        finally:
            if process.poll() is None:
                process.kill()


def read(directory: Path | str) -> Run:
    """Open the directory of a finished or unfinished run; raise InputError for any other directory."""
    return open_run(directory)


def measure(
    run: Run | Path | str, *, frames: bool = False, also: Sequence[str] = (), measures: Sequence[OwnMeasure] = ()
) -> pd.DataFrame:
    """Return the measures of a run as a table, as `smarticles measure` does.

    Args:
        run: run, or its directory.
        frames: return one row per frame.
        also: names of further measures, which take long or are seldom needed, such as "crossing-number".
        measures: further measures; a function of a frame and its run returns a number. Its name ends with the unit:
            `top_m` makes the column `top [m]`.

    Returns:
        One row per phase, with means over its last frames and their standard errors, or one row per frame. Column
        names contain the units.

    Raises:
        InputError: the directory is not a run directory, the run has no frames yet, or a name is unknown.
    """
    directory = run.path if isinstance(run, Run) else Path(run)
    return measured([directory], frames=frames, also=also, measures=[measure_of(one) for one in measures])


def plot(run: Run | Path | str, *, time: float | None = None, color_by: str | None = None) -> Image:
    """Draw the pile of a run, as `smarticles render` does; a notebook shows the picture.

    Args:
        run: run, or its directory.
        time: simulated time [s] of the frame, the nearest one; None: the last frame.
        color_by: field that colours the smarticles; None: the default of `smarticles render`.

    Raises:
        InputError: the directory is not a run directory, the run has no frames yet, or the field does not exist.
    """
    from PIL import Image as images  # noqa: N813, PLC0415  (of the extra "viz")

    from postprocess.pictures.render import render_run  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        picture = Path(scratch, "pile.png")
        render_run(run.path if isinstance(run, Run) else Path(run), output=picture, time=time, color_by=color_by)
        with images.open(picture) as image:
            return image.copy()


def read_sweep(directory: Path | str) -> SweepDirectory:
    """Open the directory of a sweep or a study, finished or not.

    Args:
        directory: directory that `smarticles sweep`, `smarticles study` or `smarticles.sweep` has made.

    Returns:
        A sequence of the runs in the order of the sweep; `values` has the variables of each run, `table()` the measures
        of all runs that have frames.

    Raises:
        InputError: the directory is not that of a sweep.
    """
    return SweepDirectory(open_folder(Path(directory)))


def sweep(
    what: Scene | Path | str,
    out: Path | str,
    *,
    vary: Mapping[str, Sequence[Any]] | None = None,
    jobs: int | None = None,
) -> SweepDirectory:
    """Compute the missing runs of a sweep on this machine, and return the finished sweep.

    Args:
        what: path of a sweep file; with `vary` a scene or the path of a scene file.
        out: directory of the sweep; may hold an unfinished part of this sweep.
        vary: values by key of the scene, with dots for nested keys. All combinations are run. The last word of a key is
            the name of the variable: {"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2, 3]} has the variables
            `aspect_ratio` and `seed`.
        jobs: number of simultaneous runs; None: one per core.

    Raises:
        InputError: a scene or the sweep is not valid, or the directory contains other files.
        RunError: a run failed.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch, _in_words_of_python(scratch):
        if vary is None and isinstance(what, Scene):
            raise InputError("vary: is missing; give the keys of the scene that change, e.g. vary={'seed': [1, 2, 3]}")
        file = write_sweep(what, vary, Path(scratch)) if vary is not None else Path(str(what))
        # Without a sweep file, `resume` continues from the scenes in the directory.
        words = ["sweep", str(file), "--out", str(out), "--submit", "local"] if vary is None else ["resume", str(out)]
        again = shlex.join(["smarticles", *words])
        folder = make_folder(file, Path(out), again)
    raise_failures(folder, compute(folder, jobs=jobs, command=again))
    return SweepDirectory(folder)


@contextmanager
def _in_words_of_python(scratch: str) -> Iterator[None]:
    """Reword error messages for Python: arguments in place of options, no paths of the folder `scratch`."""
    try:
        yield
    except (InputError, RunError) as error:
        text = str(error).replace(f"{Path(scratch).parent}/", "") if scratch in str(error) else str(error)
        for pattern, words in _IN_PYTHON:
            text = re.sub(pattern, words, text)
        raise type(error)(text) from None


# -- sweep file and template for `vary` ------------------------------------------------------------------------------


def write_sweep(scene: Scene | Path | str, vary: Mapping[str, Sequence[Any]], folder: Path) -> Path:
    """Write `sweep.yaml` and its template `scene.yaml.j2` into a folder; return the path of `sweep.yaml`.

    The sweep has all combinations of the values in `vary`, which has the form of the argument `vary` of `sweep`.
    """
    if not vary:
        raise InputError("vary: is empty; give a key of the scene and its values, e.g. {'seed': [1, 2, 3]}")
    data = _explicit_keys(scene) if isinstance(scene, Scene) else _read_scene_file(Path(scene))
    # A variable is named by the last word of its key, or by all words if two keys end alike.
    last = [key.rpartition(".")[2] for key in vary]
    names = {
        key: word if last.count(word) == 1 and not word.isdigit() else key.replace(".", "_")
        for key, word in zip(vary, last, strict=True)
    }
    text = as_template(data, names, "scene" if isinstance(scene, Scene) else str(scene))
    (folder / "scene.yaml.j2").write_text(text, encoding="utf-8")
    grid = {name: list(vary[key]) for key, name in names.items() if name != SEED}
    content: dict[str, Any] = {
        "schema_version": 1,
        "name": str(data.get("name", "sweep")),
        "template": "scene.yaml.j2",
        "run_name": "_".join(f"{name}{{{{ {name} }}}}" for name in names.values()),
        "points": {"grid": grid} if grid else {"list": [{}]},
        **({"repeats": {"seeds": list(vary[SEED])}} if SEED in names.values() else {}),
    }
    file = folder / "sweep.yaml"
    file.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return file


def _explicit_keys(scene: Scene) -> dict[str, Any]:
    """Return the keys that were set explicitly in a scene, with their values, as nested mappings.

    Keys of `fidelity` are left out if their values follow from the rest of the scene, since varied keys may change
    these.
    """
    data = scene.model_dump(mode="json", exclude_unset=True)
    if "fidelity" in data:
        derived = dict(scene.named_knobs)
        if scene.smooth:
            derived["stiffness_N_per_m"] = max(derived["stiffness_N_per_m"], stiffness_for(scene))
        differing = {key: value for key, value in data["fidelity"].items() if derived.get(key) != value}
        data["fidelity"] = {**differing, "base": scene.fidelity.base}
    return {"schema_version": SCHEMA_VERSION, **data}


def _read_scene_file(path: Path) -> dict[str, Any]:
    """Return the content of a scene file, in which paths of other files are absolute."""
    try:
        data = load_yaml(read_text(path))
    except (OSError, ValueError, yaml.YAMLError) as error:
        msg = f"{path}: cannot be read ({' '.join(str(error).split())}); give a scene or the path of a scene file"
        raise InputError(msg) from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: a scene is a mapping of keys to values, got {type(data).__name__}")
    phases = data["phases"] if isinstance(data.get("phases"), list) else ()
    # These paths are relative to the scene file, and the template is in another folder.
    for part, key in [(data.get("contact"), PRESET), *((phase, "run") for phase in phases)]:
        if isinstance(part, dict) and isinstance(part.get(key), str):
            part[key] = str((path.parent / part[key]).resolve())
    return data
