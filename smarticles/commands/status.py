"""status: which runs are done, running, failed, missing."""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from smarticles.command_line import Commands, add_shared, as_json, columns, positive_number

if TYPE_CHECKING:
    from templates.sweep.folder import RunStatus

_EVERY_S = 2.0


def add(commands: Commands) -> None:
    """Add the command."""
    status = commands.add(
        "status",
        show_status,
        summary="what is done, running, failed, missing",
        text="""
From the run directories, and from Slurm's queue if the sweep was submitted. A run is `interrupted` when it was asked to
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
        help="check again and again until nothing runs or waits in a queue; Ctrl-C ends it, and no run",
    )
    status.add_argument(
        "--every", type=positive_number, metavar="S", help="with --watch: seconds between checks; default: 2"
    )
    add_shared(status, "--json")


def show_status(arguments: argparse.Namespace) -> int:
    """Print the state of a directory, once or again and again."""
    directory: Path = arguments.directory
    if arguments.json and arguments.watch:
        raise InputError("--watch: is for a person; leave it out with --json")
    if arguments.every is not None and not arguments.watch:
        raise InputError(f"--every {arguments.every:g}: is how often --watch checks; add --watch")
    if arguments.watch:
        _watch(directory, arguments.every or _EVERY_S)
    elif arguments.json:
        state = _state(directory)
        runs = [run.to_dict() for run in state.runs]
        content = {"name": state.name, "counts": state.counts, "queue": state.queue, "runs": runs}
        print(as_json({"directory": str(directory), **content}))
    else:
        print(_state(directory))
    return 0


@dataclass(frozen=True)
class _State:
    """A directory at one moment."""

    name: str
    runs: Sequence[RunStatus]
    queue: dict[str, Any] | None = None

    @property
    def counts(self) -> dict[str, int]:
        return dict(Counter(run.state for run in self.runs))

    @property
    def goes_on(self) -> bool:
        return any(run.state in ("running", "queued") for run in self.runs)

    def __str__(self) -> str:
        lines = [_table(self.runs)]
        if self.queue is not None and self.queue["error"]:
            lines.append(f"{self.queue['error']}; the states are those of the run directories alone")
        counted = ", ".join(f"{n} {state}" for state, n in self.counts.items())
        return "\n".join([*lines, f"{self.name}: {len(self.runs)} runs, {counted}"])


def _state(directory: Path) -> _State:
    from templates.slurm.submission import QueueError, merged, submissions, tasks_of_runs  # noqa: PLC0415
    from templates.sweep.folder import open_folder, run_status  # noqa: PLC0415

    if (directory / MANIFEST).is_file() and not (directory / OF_SWEEP).exists():
        return _State(directory.name, [run_status(directory)])
    folder = open_folder(directory)
    runs, submitted = folder.status(), submissions(directory)
    if not submitted:
        return _State(folder.name, runs)
    queue: dict[str, Any] = {"jobs": [one.job_id for one in submitted if one.job_id is not None], "error": None}
    try:
        tasks = tasks_of_runs(submitted)
    except QueueError as error:
        return _State(folder.name, runs, {**queue, "error": str(error), "tasks": {}})
    states = Counter({task.label: task.slurm_state for task in tasks.values()}.values())
    runs = [merged(run, tasks.get(run.name)) for run in runs]
    return _State(folder.name, runs, {**queue, "tasks": dict(sorted(states.items()))})


def _watch(directory: Path, every: float) -> None:
    """Check until nothing goes on; a terminal shows the newest state, a pipe those that differ."""
    from rich.console import Console  # noqa: PLC0415
    from rich.live import Live  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    console = Console(soft_wrap=True)
    # Text, not markup: names of runs are data. What does not fit is cut while it is live, and whole at the end.
    live = Live(console=console, auto_refresh=False, vertical_overflow="ellipsis") if console.is_terminal else None
    printed = ""
    try:
        if live:
            live.start()
        while True:
            state = _state(directory)
            text = str(state)
            if live:
                live.update(Text(text), refresh=True)
            elif text != printed:
                print(text, flush=True)
            printed = text
            if not state.goes_on:
                return
            time.sleep(every)
    except KeyboardInterrupt:
        return  # the way in which a watch ends; the runs are other processes
    finally:
        if live:
            live.vertical_overflow = "visible"
            live.stop()


def _table(runs: Sequence[RunStatus]) -> str:
    early = any(run.state in ("failed", "interrupted", "stopped") for run in runs)
    queued = any(run.job for run in runs)
    header = ["run", "state", *(["job"] if queued else []), "phase", "simulated s"]
    header += [*(["checkpoint s"] if early else []), "wall s", "cause"]
    rows = [
        [
            run.name,
            run.state,
            *([run.job or ""] if queued else []),
            run.phase or "",
            run.time_s,
            # What was computed after it is computed again.
            *([run.checkpoint_s if run.state in ("failed", "interrupted", "stopped") else None] if early else []),
            run.wall_s,
            run.cause or "",
        ]
        for run in runs
    ]
    return columns(header, rows)
