"""Command `status`: print the state of each run of a sweep, a study or a single run."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from dem.terminal import bare, escaped
from smarticles.command_line import Commands, add_options, as_json, columns, positive_number

if TYPE_CHECKING:
    from templates.sweep.folder import RunStatus

_CHECK_INTERVAL_S = 2.0
_ENDED_EARLY = ("failed", "interrupted", "stopped")  # states of runs that ended before they were done


def add(commands: Commands) -> None:
    """Add `status` to the command line."""
    status = commands.add(
        "status",
        show_status,
        summary="print which runs are done, running, failed or missing",
        text="""
Reads the run directories, and Slurm's queue if the sweep was submitted to it. States of a run:

  done         finished
  running      a process computes it
  queued       a task in Slurm's queue will compute it
  interrupted  it received Ctrl-C or a signal, and closed its files
  stopped      its process was killed
  failed       it ended with an error
  missing      it has not started

`simulated s` is the simulated time reached [s]. `checkpoint s` is the simulated time of the last checkpoint, from
which `smarticles resume` continues.""",
        examples="""\
  smarticles status friction
  smarticles status friction/runs/mu0.2_seed1
  smarticles status friction --watch               repeat until all runs have ended
  smarticles status friction --watch --every 60
  smarticles status friction --json | jq .counts
  smarticles status runs/a runs/b                  several directories, one below the other
""",
    )
    status.add_argument(
        "directories", nargs="+", type=Path, metavar="DIR", help="directories of sweeps, studies or runs"
    )
    status.add_argument(
        "--watch",
        action="store_true",
        help="repeat until no run is running or queued; Ctrl-C ends the command, not the runs",
    )
    status.add_argument(
        "--every", type=positive_number, metavar="S", help="with --watch: time between two checks [s]; default: 2"
    )
    add_options(status, "--json", help="print JSON, for programs; of several directories, a list")


def show_status(arguments: argparse.Namespace) -> int:
    """Print the states of the runs in directories, once or repeatedly; return the exit status."""
    directories: list[Path] = arguments.directories
    if arguments.json and arguments.watch:
        raise InputError("--watch: cannot be combined with --json; leave it out with --json")
    if arguments.every is not None and not arguments.watch:
        raise InputError(f"--every {arguments.every:g}: sets the time between two checks of --watch; add --watch")
    if arguments.watch:
        _watch(directories, arguments.every or _CHECK_INTERVAL_S)
        return 0
    found = _read_all(directories)
    if arguments.json:
        contents = [
            {"directory": str(directory), **status.to_dict()}
            for directory, status in zip(directories, found, strict=True)
        ]
        print(as_json(contents if len(contents) > 1 else contents[0]))
    else:
        print(_text(found))
    return 0


@dataclass(frozen=True)
class _Status:
    name: str  #: Name of the sweep, or of the run directory
    runs: Sequence[RunStatus]
    queue: dict[str, Any] | None = None  #: Jobs, error and task counts of Slurm's queue; None: never submitted

    @property
    def counts(self) -> dict[str, int]:
        """Number of runs by state."""
        return dict(Counter(run.state for run in self.runs))

    @property
    def active(self) -> bool:
        """Whether any run is running or queued."""
        return any(run.state in ("running", "queued") for run in self.runs)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        runs = [run.to_dict() for run in self.runs]
        return {"name": self.name, "counts": self.counts, "queue": self.queue, "runs": runs}

    def __str__(self) -> str:
        lines = [_table(self.runs)]
        if self.queue is not None and self.queue["error"]:
            lines.append(f"{self.queue['error']}; the states above come from the run directories alone")
        counts = ", ".join(f"{count} {state}" for state, count in self.counts.items())
        runs = "1 run" if len(self.runs) == 1 else f"{len(self.runs)} runs"
        return "\n".join([*lines, f"{self.name}: {runs}, {counts}"])


def _read_all(directories: Sequence[Path]) -> list[_Status]:
    return [_read_status(directory) for directory in directories]


def _text(found: Sequence[_Status]) -> str:
    return "\n\n".join(map(str, found))


def _read_status(directory: Path) -> _Status:
    from templates.slurm.submission import QueueError, merged, submissions, tasks_of_runs  # noqa: PLC0415
    from templates.sweep.folder import open_folder, run_status  # noqa: PLC0415

    if (directory / MANIFEST).is_file() and not (directory / OF_SWEEP).exists():
        return _Status(directory.name, [run_status(directory)])
    folder = open_folder(directory)
    runs, submitted = folder.status(), submissions(directory)
    if not submitted:
        return _Status(folder.name, runs)
    queue: dict[str, Any] = {
        "jobs": [submission.job_id for submission in submitted if submission.job_id is not None],
        "error": None,
    }
    try:
        tasks = tasks_of_runs(submitted)
    except QueueError as error:
        return _Status(folder.name, runs, {**queue, "error": str(error), "tasks": {}})
    states = Counter({task.label: task.slurm_state for task in tasks.values()}.values())
    runs = [merged(run, tasks.get(run.name)) for run in runs]
    return _Status(folder.name, runs, {**queue, "tasks": dict(sorted(states.items()))})


def _watch(directories: Sequence[Path], interval: float) -> None:
    """Print the status of directories every `interval` [s] until no run is active.

    A terminal shows the newest status in place. Other output, such as a pipe, gets a new table after each change.
    """
    from rich.console import Console  # noqa: PLC0415
    from rich.live import Live  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    console = Console(file=bare(sys.stdout), soft_wrap=True)
    # `Text`, since names of runs may contain rich's markup. A long table is cut to the terminal until the last update.
    live = Live(console=console, auto_refresh=False, vertical_overflow="ellipsis") if console.is_terminal else None
    printed = ""
    try:
        if live:
            live.start()
        while True:
            found = _read_all(directories)
            text = escaped(_text(found))
            if live:
                live.update(Text(text), refresh=True)
            elif text != printed:
                print(text, flush=True)
            printed = text
            if not any(status.active for status in found):
                return
            time.sleep(interval)
    except KeyboardInterrupt:
        return  # Ctrl-C ends the command alone; the runs are other processes
    finally:
        if live:
            live.vertical_overflow = "visible"
            live.stop()


def _table(runs: Sequence[RunStatus]) -> str:
    """Return a table with one row per run; only columns in which a run has a value."""
    early = [run.checkpoint_s if run.state in _ENDED_EARLY else None for run in runs]
    every: dict[str, Sequence[object]] = {
        "run": [run.name for run in runs],
        "state": [run.state for run in runs],
        "job": [run.job or "" for run in runs],
        "phase": [run.phase or "" for run in runs],
        "simulated s": [run.time_s for run in runs],
        "checkpoint s": early,
        "wall s": [run.wall_s for run in runs],
        "cause": [run.cause or "" for run in runs],
    }
    shown = {name: cells for name, cells in every.items() if any(cell not in (None, "") for cell in cells)}
    return columns(list(shown), list(zip(*shown.values(), strict=True)))
