"""status: what is done, running, failed, missing."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from smarticles.layout import columns
from smarticles.parsing import Commands, add_json

if TYPE_CHECKING:
    from templates.sweep.folder import RunStatus

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
  smarticles status friction --json | jq .counts
""",
    )
    status.add_argument("directory", type=Path, metavar="DIR", help="of a sweep, a study or a run")
    add_json(status)


def show_status(arguments: argparse.Namespace) -> int:
    """`smarticles status`."""
    from dem.record.rundir import in_use  # noqa: PLC0415
    from templates.sweep.folder import MANIFEST, count_states, open_folder, run_status  # noqa: PLC0415

    directory: Path = arguments.directory
    queue: dict[str, object] | None = None
    if (directory / "run.json").is_file() and not (directory / MANIFEST).exists():
        runs = [run_status(directory, active=in_use(directory))]
        name = directory.name
    else:
        folder = open_folder(directory)
        runs, name = folder.status(), folder.name
        runs, queue = _with_queue(runs, directory)
    counts = count_states(runs)
    if arguments.json:
        content: Mapping[str, object] = {
            "directory": str(directory),
            "name": name,
            "counts": counts,
            "queue": queue,
            "runs": [run.to_dict() for run in runs],
        }
        print(json.dumps(content, indent=2, ensure_ascii=False))
        return 0
    print(_status_table(runs))
    if queue is not None and queue["error"]:
        print(f"{queue['error']}; the states are those of the run directories alone")
    print(f"{name}: {len(runs)} runs, " + ", ".join(f"{n} {state}" for state, n in counts.items()))
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
