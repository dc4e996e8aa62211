"""The Python API beside names that live elsewhere: run a scene, read a run, compute a sweep."""

from __future__ import annotations

import shlex
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import pandas as pd
import yaml

from dem.errors import InputError, RunError
from dem.record.run import Run, open_run
from dem.scene.reading import SCHEMA_VERSION, apply_override, dump_scene
from dem.scene.scene import Scene
from dem.scene.yaml_text import load_yaml
from dem.setting.fidelity import fidelities
from smarticles.main import BAD_INPUT
from smarticles.measuring import grouped, measured
from smarticles.sweeps import compute, make_folder, raise_failures
from templates.local import environment, smarticles_command
from templates.sweep.folder import Folder, open_folder
from templates.sweep.sweep_file import SEED


@dataclass(frozen=True)
class SweepDirectory(Sequence[Run]):
    """The runs of a sweep in its order, and tables of all of them."""

    folder: Folder

    @property
    def path(self) -> Path:
        """The sweep's directory."""
        return self.folder.path

    @cached_property
    def values(self) -> pd.DataFrame:
        """Variables and constants of the sweep: one row per run, by the runs' names."""
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

    def table(self, *, by: str | Sequence[str] | None = None, frames: bool = False) -> pd.DataFrame:
        """Return all measures of the runs that have begun, with what the sweep varies as columns.

        Args:
            by: columns, such as variables of the sweep, whose values make a group: then one row per group and phase,
                means over its runs with "… SE […]", the standard error from run to run.
            frames: one row per frame; else one per run and phase.

        Raises:
            InputError: no run has frames yet, there is no such column, or groups of frames are asked for.
        """
        if by is not None and frames:
            raise InputError("by: averages over phases of runs; leave frames out")
        table = measured([self.path], frames=frames)
        return table if by is None else grouped(table, [by] if isinstance(by, str) else list(by))


def run(
    scene: Scene | Path | str, out: Path | str, *, threads: int = 1, ranks: int | None = None, resume: bool = False
) -> Run:
    """Run a scene into a run directory, as `smarticles run` does, in a process of its own.

    Of its own, because YADE and PyVista must not be loaded in one process.

    Args:
        out: the run directory; must not exist or be empty, or with `resume` hold an unfinished run of this scene.
        threads: of the engine; only one gives the same bits again.
        resume: go on from the last checkpoint.

    Raises:
        InputError: the scene is not valid, or `out` holds something else.
        RunError: the run failed or was stopped.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        file = Path(scratch, "scene.yaml") if isinstance(scene, Scene) else Path(scene)
        if isinstance(scene, Scene):
            file.write_text(dump_scene(scene), encoding="utf-8")
        words = [*smarticles_command(file, Path(out), resume), "--threads", str(threads)]
        words += [] if ranks is None else ["--ranks", str(ranks)]
        done = subprocess.run(
            words, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False
        )
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}, without a word"]
        text = said[-1].removeprefix("smarticles: ").removeprefix("error: ")
        raise InputError(text) if done.returncode == BAD_INPUT else RunError(text)
    return Run(Path(out))


def read(directory: Path | str) -> Run:
    """Open a run directory, finished or not.

    Raises:
        InputError: it is none.
    """
    return open_run(directory)


def measure(run: Run | Path | str, *, frames: bool = False) -> pd.DataFrame:
    """Return all measures of a run as a table, units in its column names, as `smarticles measure` does.

    Args:
        frames: one row per frame; else one per phase, means over its last frames with their standard errors.

    Raises:
        InputError: it is no run, or has no frames yet.
    """
    return measured([run.path if isinstance(run, Run) else Path(run)], frames=frames)


def read_sweep(directory: Path | str) -> SweepDirectory:
    """Open a sweep's or a study's directory, its runs done or not.

    Raises:
        InputError: it is none.
    """
    return SweepDirectory(open_folder(Path(directory)))


def sweep(
    what: Scene | Path | str,
    out: Path | str,
    *,
    vary: Mapping[str, Sequence[Any]] | None = None,
    jobs: int | None = None,
) -> SweepDirectory:
    """Run many scenes into one directory on this machine, or what is missing of them.

    Args:
        what: a sweep file; or, with `vary`, a scene or the file of one.
        out: the sweep's directory; taken up where it holds this sweep already.
        vary: keys of the scene, dots for nesting, and the values that each takes: every combination is run. The last
            word of a key is the variable's name: {"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2, 3]} gives
            columns `aspect_ratio` and `seed`.
        jobs: runs at once; by default one per core.

    Raises:
        InputError: a scene or the sweep is not valid, or the directory holds something else.
        RunError: a run failed.
    """
    with tempfile.TemporaryDirectory(prefix="smarticles-") as scratch:
        if vary is None and isinstance(what, Scene):
            raise InputError("vary: is missing; give the keys of the scene that change, e.g. vary={'seed': [1, 2, 3]}")
        file = write_sweep(what, vary, Path(scratch)) if vary is not None else Path(str(what))
        # The scenes of a sweep without a file are in its directory, and `resume` needs no more.
        words = ["sweep", str(file), "--out", str(out), "--submit", "local"] if vary is None else ["resume", str(out)]
        again = shlex.join(["smarticles", *words])
        folder = make_folder(file, Path(out), again)
    raise_failures(folder, compute(folder, jobs=jobs, command=again))
    return SweepDirectory(folder)


# -- a scene and the keys of it that vary, as the sweep file and template that they stand for --------------------------


def write_sweep(scene: Scene | Path | str, vary: Mapping[str, Sequence[Any]], folder: Path) -> Path:
    """Write `sweep.yaml` and `scene.yaml.j2` for all combinations of `vary`; return the former.

    Raises:
        InputError: the scene cannot be read, has no such place or holds marks of a template, or there is nothing to
            vary.
    """
    if not vary:
        raise InputError("vary: is empty; give a key of the scene and its values, e.g. {'seed': [1, 2, 3]}")
    data = _plain(scene) if isinstance(scene, Scene) else _read(Path(scene))
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    for mark in ("{{", "{%", "{#"):
        if mark in text:
            name = "scene" if isinstance(scene, Scene) else scene
            raise InputError(f"{name}: holds {mark!r}, which a template would take for its own; write it without")
    # The last word of a key names its variable, or all of its words where another key ends alike.
    last = [key.rpartition(".")[2] for key in vary]
    names = {
        key: word if last.count(word) == 1 and not word.isdigit() else key.replace(".", "_")
        for key, word in zip(vary, last, strict=True)
    }
    for key, name in names.items():
        apply_override(data, f"{key}='{{{{ {name} }}}}'")
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    for name in names.values():
        text = text.replace(f"'{{{{ {name} }}}}'", f"{{{{ {name} }}}}")
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


def _plain(scene: Scene) -> dict[str, Any]:
    """Return the keys that were set, without those which follow from others and may follow differently in a run."""
    data = scene.model_dump(mode="json", exclude_unset=True)
    if "fidelity" in data:
        named = fidelities(scene.engine)[scene.fidelity.base]
        differing = {key: value for key, value in data["fidelity"].items() if named.get(key) != value}
        data["fidelity"] = {**differing, "base": scene.fidelity.base}
    return {"schema_version": SCHEMA_VERSION, **data}


def _read(path: Path) -> dict[str, Any]:
    try:
        data = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        msg = f"{path}: cannot be read ({' '.join(str(error).split())}); give a scene or the path of a scene file"
        raise InputError(msg) from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: a scene is a mapping of keys to values, got {type(data).__name__}")
    for phase in data["phases"] if isinstance(data.get("phases"), list) else ():
        # Relative to the scene file; the template lies elsewhere.
        if isinstance(phase, dict) and isinstance(phase.get("run"), str):
            phase["run"] = str((path.parent / phase["run"]).resolve())
    return data
