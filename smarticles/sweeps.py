"""Directories of sweeps as commands take them: made or taken up, their runs computed here."""

from __future__ import annotations

import argparse
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from dem.errors import RunError

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from templates.local.display import Outcome
    from templates.sweep.expand import Point
    from templates.sweep.folder import Folder
    from templates.sweep.sweep_file import Sweep


def make_folder(
    file: Path,
    out: Path,
    command: str,
    constants: Mapping[str, str] | None = None,
    *,
    engine: str | None = None,
    max_points: int | None = None,
) -> Folder:
    """Expand a sweep file into its directory, or take up the directory that holds it already.

    Args:
        file: sweep file.
        out: directory of the sweep.
        command: the command line, for the manifest.
        constants: values that replace those of the file.
        engine: what all its runs are to be computed by; None: what the file says.
        max_points: how many runs it may have; None: the usual limit.

    Raises:
        InputError: the sweep is not valid, or the directory holds something else.
    """
    from templates.sweep.expand import MAX_POINTS, expand  # noqa: PLC0415

    sweep = changed_sweep(file, constants or {}, engine=engine)
    return folder_of(sweep, expand(sweep, max_points=max_points or MAX_POINTS), out, command)


def changed_sweep(file: Path, constants: Mapping[str, str], *, engine: str | None = None) -> Sweep:
    """A sweep file as a command changes it; see `make_folder`."""
    from templates.sweep.sweep_file import load_sweep, on_engine, with_constants  # noqa: PLC0415

    sweep = with_constants(load_sweep(file), constants)
    return sweep if engine is None else on_engine(sweep, engine)


def folder_of(sweep: Sweep, points: Sequence[Point], out: Path, command: str, *, extend: bool = False) -> Folder:
    """The directory of an expanded sweep; see `templates.sweep.folder.create_folder`."""
    from templates.sweep.folder import create_folder  # noqa: PLC0415

    return create_folder(
        out, sweep, points, command=command, versions=versions(), expected_s=expected_wall_s, extend=extend
    )


def versions() -> dict[str, str]:
    """Versions of what expands a sweep; each run records those of what computes it."""
    packages = ("smarticles", "jinja2", "pydantic", "pyyaml")
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}


def expected_wall_s(scene: Scene) -> float:
    """Expected wall time of a scene [s], on a machine like the one the costs were measured on."""
    from dem.plan.outlook import plan  # noqa: PLC0415

    return plan(scene).wall_s


def complete(folder: Folder, *, jobs: int | None, command: str) -> None:
    """Run what a sweep is missing.

    Args:
        folder: the sweep's directory.
        jobs: runs at once; None: one per core.
        command: what to give again after Ctrl-C.

    Raises:
        InputError: runs of the sweep are in a queue.
        RunError: a run failed.
        KeyboardInterrupt: Ctrl-C; the message says how to go on.
    """
    refuse_failures(folder, compute(folder, jobs=jobs, command=command))


def compute(folder: Folder, *, jobs: int | None, command: str) -> list[Outcome]:
    """The same, but a run that failed is told, not raised."""
    from rich.console import Console  # noqa: PLC0415

    from templates.local.display import Display  # noqa: PLC0415
    from templates.local.runner import run_folder  # noqa: PLC0415
    from templates.slurm.submission import refuse_queued  # noqa: PLC0415

    refuse_queued(folder)
    try:
        return run_folder(folder, Display(Console(stderr=True)), slots=jobs)
    except KeyboardInterrupt:
        msg = f"finished runs are kept; go on with: {command}"
        raise KeyboardInterrupt(msg) from None


def complete_and_tell(folder: Folder, arguments: argparse.Namespace) -> int:
    """Run what a sweep is missing, for a command with --jobs; say what comes next."""
    complete(folder, jobs=arguments.jobs, command=arguments.command_line)
    print(f"{folder.path}: all {len(folder.entries)} runs are done; next: smarticles measure {folder.path}")
    return 0


def refuse_failures(folder: Folder, outcomes: Sequence[Outcome]) -> None:
    """Say what is missing, if anything is.

    Raises:
        RunError: a run failed.
    """
    failed = [outcome for outcome in outcomes if outcome.missing]
    if failed:
        causes = "; ".join(f"{outcome.name}: {outcome.cause}" for outcome in failed)
        msg = (
            f"{folder.path}: {len(failed)} of {len(outcomes)} runs are missing: {causes}; "
            f"logs are in {folder.path / 'logs'}, start them again: smarticles resume {folder.path}"
        )
        raise RunError(msg)
