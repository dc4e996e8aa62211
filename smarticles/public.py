"""Python API: run and read scenes and sweeps, and measure them."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, overload

import pandas as pd
import yaml

from dem.display import Display
from dem.errors import InputError, RunError, shown
from dem.record.frame import Frame
from dem.record.names import MANIFEST, SCENE
from dem.record.progress import row_of
from dem.record.run import Run, open_run
from dem.scene.reading import dump_scene
from dem.scene.scene import SCHEMA_VERSION, Scene
from dem.setting.contact import PRESET
from dem.yaml_text import load_yaml, read_text
from postprocess.measures.registry import FrameMeasure, Values, measure_of
from smarticles.labelled import dataset_of
from smarticles.main import BAD_INPUT
from smarticles.measuring import grouped, measured, of_phase, states, values_in
from smarticles.notebook import show_sweep
from smarticles.sweeps import compute, make_folder, raise_failures
from templates.local import cause_of, environment, smarticles_command
from templates.sweep.folder import Folder, open_folder
from templates.sweep.from_scene import variables, varied_template
from templates.sweep.sweep_file import SEED

if TYPE_CHECKING:
    from PIL.Image import Image

    from postprocess.report.series import Chart

#: A measure, or a function of a frame and its run, whose name ends with the unit of its value: `top_m`
OwnMeasure = FrameMeasure | Callable[[Frame, Run], Values]

#: Values by key of the scene, with dots for nested keys; in place of a list, a mapping of names to values
Varied = Mapping[str, Sequence[Any] | Mapping[str, Any]]

# Options of the command line and keys of `vary`, as messages name them, and what Python calls them.
_IN_PYTHON = (
    (r"go on with it by --resume", "resume=True continues it, or returns it if it is done"),
    (r"resume with \S+ and no --set, or run the changed scene", "run the changed scene"),
    (r"--resume\b", "resume=True"),
    (r"--(threads|ranks|jobs) (\d+)", r"\1=\2"),
    (r"--(out|threads|ranks|jobs)\b", r"\1"),
    (r"smarticles-\w+/scene\.yaml\.j2, rendered for run", "vary: run"),
    (r"smarticles-\w+/sweep\.yaml", "vary"),
    (r"smarticles-\w+/scene\.yaml(\.j2)?", "scene"),
)


_WARNING = "smarticles: warning: "  # begins warnings of the command
_MOST_VALUES = 6  # of a variable, in the text of a sweep
_POLL_S = 0.25  # between two readings of the progress of a run


@dataclass(frozen=True, repr=False)
class SweepDirectory(Sequence[Run]):
    """Directory of a sweep: a sequence of its runs, and tables of their measures."""

    folder: Folder  #: Manifest and entries of the sweep

    def __repr__(self) -> str:
        """Return directory, number of runs and values of the variables in one line."""
        listed = "; ".join(f"{name}: {_few(values)}" for name, values in values_in(self.folder).items())
        return f"<SweepDirectory {str(self.path)!r}, {len(self)} runs, {listed}>"

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

    def _repr_html_(self) -> str:
        return show_sweep(self.path, self[:], self.values)

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
        also: Sequence[str] = (),
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
            also: names of measures that tables have on request alone, such as "crossing-number".
            measures: further measures; a function of a frame and its run returns a number, an array of numbers or a
                dict of these.
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
        table = measured([self.path], frames=frames, also=_names(also), measures=_measures(measures), jobs=jobs)
        if by is None:
            return table
        names = [by] if isinstance(by, str) else list(by)
        return grouped(table, names, runs=states([self.path]), unfinished=unfinished)

    def to_xarray(
        self,
        *,
        phase: str | int = "last",
        also: Sequence[str] = (),
        measures: Sequence[OwnMeasure] = (),
        jobs: int = 1,
    ) -> Any:
        """Return the measures of one phase of all runs as a `Dataset` of xarray, see `dataset_of`.

        Args:
            phase: type of phase, of which the last one of each run that has frames is taken; "last": of all types;
                or the number of a phase in the scene, from 0.
            also: names of measures on request, as for `table`.
            measures: further measures, as for `table`.
            jobs: number of processes, as for `table`.

        Raises:
            InputError: xarray is not installed, no run has frames yet, or no run has the phase.
        """
        table = self.table(also=also, measures=measures, jobs=jobs)
        # A run may have several phases of one type.
        table = of_phase(table, phase).drop_duplicates("run", keep="last")
        known = {str(self.folder.run(entry)): entry.values for entry in self.folder.entries}
        return dataset_of(table, [known[str(run)] for run in table["run"]])


def run(
    scene: Scene | Mapping[str, Any] | Path | str,
    out: Path | str,
    *,
    threads: int = 1,
    ranks: int | None = None,
    resume: bool = False,
    progress: bool = True,
) -> Run:
    """Run a scene in a new process, as `smarticles run` does, and return the finished run.

    A new process is needed because YADE and PyVista must not be loaded in one process. Its warnings,
    such as of values that are probably mistakes, become warnings of Python.

    Args:
        scene: scene, its keys as a mapping, or path of a scene file.
        out: run directory. It must be absent or empty; with `resume` it may hold a run of this scene.
        threads: number of threads of YADE. Results are reproducible bit by bit with one thread only.
        ranks: number of MPI processes of LAMMPS; None: 1, or with `resume` the number at the start.
        resume: if `out` holds a run of this scene, continue it from its last checkpoint, or return it at once if it is
            done; otherwise start it. So a cell of a notebook can be run again.
        progress: show a bar on the terminal or in the notebook; elsewhere a line every 30 s.

    Raises:
        InputError: the scene is not valid, or `out` contains other files.
        RunError: the run failed or was stopped.
        KeyboardInterrupt: Ctrl-C stopped the run; all its files are complete.
    """
    scene, out = _scene_or_file(scene), _path("out", out)
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch, _in_words_of_python(scratch):
        file = Path(scratch, "scene.yaml") if isinstance(scene, Scene) else Path(scene)
        if isinstance(scene, Scene):
            file.write_text(dump_scene(scene), encoding="utf-8")
        held = (out / MANIFEST).is_file()
        words = [*smarticles_command(file, out, resume and held), "--threads", str(threads)]
        words += [] if ranks is None else ["--ranks", str(ranks)]
        if isinstance(scene, Scene):
            # The file in the temporary folder will not exist; `scene.yaml` in the run directory will.
            words += ["--recorded-as", shlex.join(["smarticles", "run", str(out / SCENE), "--out", "NEW"])]
        with Path(scratch, "said").open("w+", encoding="utf-8", errors="replace") as said:
            # In a session of its own: Ctrl-C reaches this process alone, which signals the run once.
            process = subprocess.Popen(
                words, env=environment(), stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
            )
            status = _wait(process, out, progress=progress)
            said.seek(0)
            output = said.read()
        if status:
            raise (InputError if status == BAD_INPUT else RunError)(cause_of(output, status))
    for line in output.splitlines():
        if line.startswith(_WARNING):
            warnings.warn(line.removeprefix(_WARNING), stacklevel=2)
    return Run(out)


def _scene_or_file(given: Scene | Mapping[str, Any] | Path | str) -> Scene | Path:
    if isinstance(given, Mapping):
        return Scene(**{str(key): value for key, value in given.items()})
    if isinstance(given, str | os.PathLike):
        return Path(given)
    if isinstance(given, Scene):
        return given
    raise InputError(f"scene: {shown(given)} is none; give a Scene, its keys as a mapping, or the path of a scene file")


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
    return open_run(_path("directory", directory))


def _path(name: str, given: object) -> Path:
    """Return the directory of a run or a sweep, or a path itself; InputError for anything else."""
    if isinstance(given, Run | SweepDirectory):
        return given.path
    if isinstance(given, str | os.PathLike):
        return Path(given)
    raise InputError(f"{name}: {shown(given)} is no directory; give its path, or a run that was read")


def measure(
    run: Run | SweepDirectory | Path | str,
    *,
    frames: bool = False,
    also: Sequence[str] = (),
    measures: Sequence[OwnMeasure] = (),
) -> pd.DataFrame:
    """Return the measures of a run or a sweep as a table, as `smarticles measure` does.

    Args:
        run: run or sweep, or its directory.
        frames: return one row per frame.
        also: names of further measures, which take long or are seldom needed, such as "crossing-number".
        measures: further measures; a function of a frame and its run returns a number, an array of numbers or a dict of
            these. Names of functions and of the dict's keys end with the unit: `top_m` makes the column `top [m]`.

    Returns:
        One row per phase, with means over its last frames and their standard errors, or one row per frame. Column
        names contain the units.

    Raises:
        InputError: the directory is not a run directory, the run has no frames yet, or a name is unknown.
    """
    return measured([_path("run", run)], frames=frames, also=_names(also), measures=_measures(measures))


def _names(also: Sequence[str]) -> tuple[str, ...]:
    if isinstance(also, str):
        raise InputError(f"also: {also!r} is one name; give a list, [{also!r}]")
    return tuple(also)


def _measures(given: Sequence[OwnMeasure]) -> list[FrameMeasure]:
    """Return measures, made from functions where they are functions; InputError if one is neither."""
    if callable(given):
        raise InputError(f"measures: {shown(given)} is no list; write it in brackets, measures=[…]")
    for one in [given] if isinstance(given, str) else given:
        if isinstance(one, str):
            raise InputError(
                f"measures: {one!r} is text; give functions of a frame and its run; tables have all other measures "
                "anyway, and those on request by also=[…]"
            )
        if not isinstance(one, FrameMeasure) and not hasattr(one, "__name__"):
            raise InputError(f"measures: {shown(one)} is no function with a name; write one, `def top_m(frame, run)`")
    return [measure_of(one) for one in given]


def _few(values: Sequence[Any]) -> str:
    more = f", … ({len(values)})" if len(values) > _MOST_VALUES else ""
    return f"{', '.join(map(str, values[:_MOST_VALUES]))}{more}"


@overload
def plot(
    run: Run | Path | str, series: None = None, *, time: float | None = None, color_by: str | None = None
) -> Image: ...
@overload
def plot(run: Run | Path | str, series: str | Sequence[str]) -> Chart: ...
def plot(
    run: Run | Path | str,
    series: str | Sequence[str] | None = None,
    *,
    time: float | None = None,
    color_by: str | None = None,
) -> Image | Chart:
    """Draw the pile of a run, or recorded series against time, as `smarticles render` does; a notebook shows it.

    Args:
        run: run, or its directory.
        series: name of a series, such as "com_height_m", or several names; None: the pile.
        time: simulated time [s] of the frame, the nearest one; None: the last frame.
        color_by: field that colours the smarticles; None: the default of `smarticles render`.

    Returns:
        The picture of the pile; for series a figure of Matplotlib with phases as bands, whose
        `savefig("height.pdf")` writes PDF, SVG or PNG.

    Raises:
        InputError: the directory is not a run directory, the run has no frames or no series yet, or the field or series
            does not exist.
    """
    if series is not None:
        for name, value in (("time", time), ("color_by", color_by)):
            if value is not None:
                raise InputError(f"{name}: is for pictures of the pile, and series are drawn; leave one of them out")
        from postprocess.report.series import draw_series  # noqa: PLC0415  (of the extra "viz")

        return draw_series(open_run(_path("run", run)), [series] if isinstance(series, str) else list(series))
    from PIL import Image as images  # noqa: N813, PLC0415  (of the extra "viz")

    from postprocess.pictures.render import render_run  # noqa: PLC0415

    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        picture = Path(scratch, "pile.png")
        render_run(_path("run", run), output=picture, time=time, color_by=color_by)
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
    return SweepDirectory(open_folder(_path("directory", directory)))


def sweep(
    what: Scene | Mapping[str, Any] | Path | str,
    out: Path | str,
    *,
    vary: Varied | None = None,
    zip: Varied | None = None,  # noqa: A002  (as in sweep files)
    jobs: int | None = None,
    progress: bool = True,
) -> SweepDirectory:
    """Compute the missing runs of a sweep on this machine, and return the finished sweep.

    Args:
        what: path of a sweep file; with `vary` or `zip` a scene, its keys as a mapping, or the path of a scene file.
        out: directory of the sweep; may hold an unfinished part of this sweep.
        vary: values by key of the scene, with dots for nested keys. All combinations are run. The last word of a key is
            the name of the variable: {"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2, 3]} has the variables
            `aspect_ratio` and `seed`. Values may have names, which tables and names of runs then show:
            {"particle": {"rods": {"shape": "rod", "length_m": 0.02}, "smarticles": "smarticle"}}.
        zip: the same for keys that change together: one point for the first values of all keys, one for the second
            ones, and so on. With `vary` all combinations of these points and its values are run.
        jobs: number of simultaneous runs; None: one per core.
        progress: show runs that are computed, and lines about those that ended.

    Raises:
        InputError: a scene or the sweep is not valid, or the directory contains other files.
        RunError: a run failed.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch, _in_words_of_python(scratch):
        scene, out = _scene_or_file(what), _path("out", out)
        if vary is None and zip is None:
            if isinstance(scene, Scene):
                msg = "vary: is missing; give the keys of the scene that change, e.g. vary={'seed': [1, 2, 3]}"
                raise InputError(msg)
            file, words = scene, ["sweep", str(scene), "--out", str(out), "--submit", "local"]
        else:
            # Without a sweep file, `resume` continues from the scenes in the directory.
            file, words = write_sweep(scene, vary or {}, Path(scratch), zip or {}), ["resume", str(out)]
        again = shlex.join(["smarticles", *words])
        folder = make_folder(file, out, again)
    raise_failures(folder, compute(folder, jobs=jobs, command=again, progress=progress))
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


# -- sweep file and template for `vary` and `zip` -------------------------------------------------------------------


def write_sweep(scene: Scene | Path | str, vary: Varied, folder: Path, zipped: Varied = MappingProxyType({})) -> Path:
    """Write `sweep.yaml` and its template `scene.yaml.j2` into a folder; return the path of `sweep.yaml`.

    `vary` and `zipped` have the form of the arguments `vary` and `zip` of `sweep`.
    """
    changing = variables(vary, zipped)
    if not changing:
        raise InputError("vary: is empty; give a key of the scene and its values, e.g. {'seed': [1, 2, 3]}")
    if isinstance(scene, Scene):
        data, source = {"schema_version": SCHEMA_VERSION, **scene.given}, "scene"
    else:
        data, source = _read_scene_file(Path(scene)), str(scene)
    (folder / "scene.yaml.j2").write_text(varied_template(data, changing, source), encoding="utf-8")
    points = {
        kind: {one.name: list(one.values) for one in changing if one.source == source and one.name != SEED}
        for kind, source in (("zip", "zip"), ("grid", "vary"))
    }
    seeds = [one.values for one in changing if one.name == SEED]
    content: dict[str, Any] = {
        "schema_version": 1,
        "name": str(data.get("name", "sweep")),
        "template": "scene.yaml.j2",
        "run_name": "_".join(one.in_run_name for one in changing),
        "points": {kind: lists for kind, lists in points.items() if lists} or {"list": [{}]},
        **({"repeats": {"seeds": list(seeds[0])}} if seeds else {}),
    }
    file = folder / "sweep.yaml"
    file.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return file


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
    for part, key in [(data.get("contact"), PRESET), *((phase, key) for phase in phases for key in ("run", "file"))]:
        if isinstance(part, dict) and isinstance(part.get(key), str):
            part[key] = str((path.parent / part[key]).resolve())
    return data
