"""status: what is done, running, failed, missing."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from smarticles.layout import columns
from smarticles.parsing import Commands, add_json, positive_number

if TYPE_CHECKING:
    from templates.sweep.folder import RunStatus

_GOING_ON = ("running", "queued")
_EVERY_S = 2.0
_ENDED_EARLY = ("failed", "interrupted", "stopped")


def add(commands: Commands) -> None:
    """Add the command."""
    status = commands.add(
        "status",
        show_status,
        summary="what is done, running, failed, missing",
        text="""
From the run directories, and from Slurm's queue if the sweep was submitted. A run is `interrupted` when it was told to
stop, `stopped` when it was killed, `queued` when a task of the queue is going to compute it. `simulated s` is how far a
run came, `checkpoint s` from where it would go on.""",
        examples="""\
  smarticles status friction
  smarticles status friction/runs/mu0.2_seed1
  smarticles status friction --watch               again and again, until nothing runs
  smarticles status friction --watch --every 60
  smarticles status friction --json | jq .counts
""",
    )
    status.add_argument("directory", type=Path, metavar="DIR", help="of a sweep, a study or a run")
    status.add_argument(
        "--watch",
        action="store_true",
        help="look again and again until nothing runs or waits in a queue; Ctrl-C ends it, and no run",
    )
    status.add_argument(
        "--every", type=positive_number, metavar="S", help="with --watch: seconds between looks; default: 2"
    )
    add_json(status)


@dataclass(frozen=True, kw_only=True)
class _Look:
    """What was seen of a directory at one moment."""

    name: str
    runs: list[RunStatus]
    queue: dict[str, object] | None

    @property
    def counts(self) -> dict[str, int]:
        from templates.sweep.folder import count_states  # noqa: PLC0415

        return count_states(self.runs)

    @property
    def goes_on(self) -> bool:
        return any(run.state in _GOING_ON for run in self.runs)

    def to_text(self) -> str:
        lines = [_status_table(self.runs)]
        if self.queue is not None and self.queue["error"]:
            lines.append(f"{self.queue['error']}; the states are those of the run directories alone")
        counted = ", ".join(f"{n} {state}" for state, n in self.counts.items())
        return "\n".join([*lines, f"{self.name}: {len(self.runs)} runs, {counted}"])

    def to_dict(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "counts": self.counts,
            "queue": self.queue,
            "runs": [run.to_dict() for run in self.runs],
        }


def show_status(arguments: argparse.Namespace) -> int:
    """`smarticles status`."""
    directory: Path = arguments.directory
    if arguments.json:
        if arguments.watch:
            msg = "--watch: is for a person; leave it out with --json"
            raise InputError(msg)
        print(json.dumps({"directory": str(directory), **_look(directory).to_dict()}, indent=2, ensure_ascii=False))
        return 0
    if arguments.watch:
        return _watch(directory, arguments.every or _EVERY_S)
    if arguments.every is not None:
        msg = f"--every {arguments.every:g}: is how often --watch looks; add --watch"
        raise InputError(msg)
    print(_look(directory).to_text())
    return 0


def _look(directory: Path) -> _Look:
    from templates.sweep.folder import MANIFEST, open_folder, run_status  # noqa: PLC0415

    if (directory / "run.json").is_file() and not (directory / MANIFEST).exists():
        return _Look(name=directory.name, runs=[run_status(directory)], queue=None)
    folder = open_folder(directory)
    runs, queue = _with_queue(folder.status(), directory)
    return _Look(name=folder.name, runs=runs, queue=queue)


def _watch(directory: Path, every: float) -> int:
    """Look again and again until nothing goes on; a terminal shows the newest look, a pipe those that differ."""
    from rich.console import Console  # noqa: PLC0415
    from rich.live import Live  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    console = Console(soft_wrap=True)
    look = _look(directory)
    try:
        if not console.is_terminal:
            told = ""
            while True:
                if (text := look.to_text()) != told:
                    print(text, flush=True)
                told = text
                if not look.goes_on:
                    return 0
                time.sleep(every)
                look = _look(directory)
        # Text, not markup: names of runs are data. What does not fit is cut while it is live, and whole at the end.
        with Live(Text(look.to_text()), console=console, auto_refresh=False, vertical_overflow="ellipsis") as live:
            while look.goes_on:
                time.sleep(every)
                look = _look(directory)
                live.update(Text(look.to_text()), refresh=True)
            live.vertical_overflow = "visible"
    except KeyboardInterrupt:
        # The way in which a watch ends; the runs are other processes.
        return 0
    return 0


def _with_queue(runs: list[RunStatus], directory: Path) -> tuple[list[RunStatus], dict[str, object] | None]:
    """States with what the queue says, and how that went; None where nothing was submitted."""
    from templates.slurm.queue import QueueError  # noqa: PLC0415
    from templates.slurm.submission import merged, plain, submissions, tasks_of_runs  # noqa: PLC0415

    found = submissions(directory)
    if not found:
        return runs, None
    jobs = [one.job_id for one in found if one.job_id is not None]
    try:
        tasks = tasks_of_runs(found)
    except QueueError as error:
        return runs, {"jobs": jobs, "error": str(error), "tasks": {}}
    return [merged(run, tasks.get(run.name)) for run in runs], {"jobs": jobs, "error": None, "tasks": plain(tasks)}


def _status_table(runs: Sequence[RunStatus]) -> str:
    header = ["run", "state", "phase", "simulated s", "wall s", "cause"]
    rows = [[run.name, run.state, run.phase or "", run.time_s, run.wall_s, run.cause or ""] for run in runs]
    if any(run.state in _ENDED_EARLY for run in runs):
        # What was computed after it is computed again.
        header.insert(4, "checkpoint s")
        for row, run in zip(rows, runs, strict=True):
            row.insert(4, run.checkpoint_s if run.state in _ENDED_EARLY else None)
    if any(run.job for run in runs):
        header.insert(2, "job")
        for row, run in zip(rows, runs, strict=True):
            row.insert(2, run.job or "")
    return columns(header, rows)
