"""Compute the runs of a sweep on this machine, one process per run, by default one run per core.

Runs with the longest expected time start first, see `Folder.in_order_of_start`. A run that fails does not stop the
others. Ctrl-C stops all runs, after they have closed their files.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Self

from dem.display import Display, Row, duration
from dem.engine.cores import usable_cores
from dem.record.document import Progress
from dem.record.progress import row_of
from dem.record.run import Run
from templates.sweep.folder import Entry, Folder

RunCommand = Callable[[Path, Path, bool], Sequence[str]]
"""Returns the command that computes a run, as words; arguments: scene file, run directory, whether to resume."""

# More threads than cores would slow down all runs.
_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
_MARKS = {"done": "✔", "kept": "=", "failed": "✘", "interrupted": "■"}


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of computing one run."""

    name: str  #: Name of the run
    status: Literal["done", "kept", "failed", "interrupted"]  #: "kept": the run had finished before
    cause: str | None = None  #: Cause of a failure
    wall_s: float = 0.0  #: Wall time [s]

    @property
    def missing(self) -> bool:
        """Whether the run has no result yet."""
        return self.status not in ("done", "kept")

    def __str__(self) -> str:
        text = "finished before" if self.status == "kept" else self.status
        wall = f" after {duration(self.wall_s)}" if self.wall_s else ""
        return f"{self.name} {text}{wall}" + (f": {self.cause}" if self.status == "failed" else "")


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """State of all runs at one time."""

    total: int  #: Number of runs
    ended: int  #: Number of runs that ended, with or without a result
    failed: int  #: Number of runs that ended without a result
    running: tuple[tuple[str, float, Progress], ...]  #: Name, wall time [s] and progress of each running run
    left_s: float  #: Expected wall time left [s]

    @property
    def rows(self) -> list[Row]:
        """Rows of a display: one for each running run, one for all runs."""
        failed = f", {self.failed} failed" if self.failed else ""
        ended = f"{self.ended} of {self.total} runs ended{failed}"
        share = self.ended / self.total if self.total else 1.0
        running = [row_of(progress, label=name) for name, _, progress in self.running]
        return [*running, Row(label=ended, fraction=share, left_s=self.left_s)]


class SweepDisplay:
    """Shows the progress of a sweep: each running run and the sweep, and what became of the runs that ended."""

    def __init__(self, display: Display) -> None:
        """Show on a display, which the context of this object opens."""
        self._display = display

    def __enter__(self) -> Self:
        self._display.__enter__()
        return self

    def __exit__(self, *exception: object) -> None:
        self._display.__exit__(*exception)

    def started(self, name: str) -> None:
        """Report that a run was started."""
        if not self._display.redraws:
            self._display.print(f"{name} started")

    def ended(self, outcome: Outcome) -> None:
        """Report the outcome of a run."""
        self._display.print(f"{_MARKS[outcome.status]} {outcome}" if self._display.redraws else str(outcome))

    def update(self, snapshot: Snapshot) -> None:
        """Show the state of all runs."""
        self._display.update(*snapshot.rows)

    def stopping(self, count: int) -> None:
        """Report that `count` runs were signalled to stop."""
        self._display.print(f"stopping {count} runs, which close their files; Ctrl-C again does not wait")


def smarticles_command(scene: Path, directory: Path, resume: bool) -> tuple[str, ...]:
    """Return the command, as words, that computes a scene into a run directory with this interpreter."""
    # -P: files in the working directory must not replace libraries.
    words = (sys.executable, "-P", "-m", "smarticles", "run", str(scene), "--out", str(directory))
    return (*words, "--resume") if resume else words


def environment() -> dict[str, str]:
    """Return the environment variables of a run's process: one thread, and this process's import paths."""
    environment = {**os.environ, **_ONE_THREAD}
    # Runs start in another directory, where relative paths would be wrong.
    paths = [os.path.abspath(path) for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]  # noqa: PTH100
    root = Path(__file__).resolve().parents[1]
    if "site-packages" not in root.parts and "dist-packages" not in root.parts:
        # Runs must find this source tree, which is not installed.
        paths.insert(0, str(root))
    if paths:
        environment["PYTHONPATH"] = os.pathsep.join(paths)
    return environment


def run_folder(
    folder: Folder,
    display: SweepDisplay,
    *,
    slots: int | None = None,
    command: RunCommand = smarticles_command,
    poll_s: float = 0.25,
    grace_s: float = 60.0,
) -> list[Outcome]:
    """Compute the unfinished runs of a sweep, and return one outcome per run in the order of the manifest.

    An unfinished run continues from its last checkpoint. A run without a checkpoint, or one that failed, starts from
    its beginning; its old directory is renamed. `slots` runs are computed at once, by default one per core; `command`
    returns the command of a run. The display is updated every `poll_s` [s]; `grace_s` [s] lie between one signal to
    stop and the next stronger one. KeyboardInterrupt after Ctrl-C, when all runs were stopped.
    """
    with folder.lock() as lock, display:
        runner = _Runner(folder, display, command, slots or usable_cores(), poll_s, grace_s, lock)
        runner.run()
    return [runner.outcomes[entry.name] for entry in folder.entries]


@dataclass
class _Runner:
    folder: Folder
    display: SweepDisplay
    command: RunCommand
    slots: int
    poll_s: float
    grace_s: float
    lock: int
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    active: dict[str, tuple[subprocess.Popen[bytes], float]] = field(default_factory=dict)
    latest: dict[str, Progress] = field(default_factory=dict)
    stopping: bool = False
    guard: threading.Lock = field(default_factory=threading.Lock)

    def run(self) -> None:
        missing = []
        for entry in self.folder.entries:
            if self.folder.is_done(entry):
                self._ended(Outcome(name=entry.name, status="kept"))
            else:
                missing.append(entry)
        with ThreadPoolExecutor(self.slots) as pool:
            waiting = {pool.submit(self._compute, entry) for entry in self.folder.in_order_of_start(missing)}
            try:
                while waiting:
                    waiting = self._collect(waiting, self.poll_s)
                    self.display.update(self._snapshot())
            finally:
                # After Ctrl-C or an error no process may outlive this one.
                self._stop(waiting)

    def _collect(self, waiting: set[Future[Outcome | None]], timeout: float) -> set[Future[Outcome | None]]:
        ended, waiting = wait(waiting, timeout, FIRST_COMPLETED)
        for future in ended:
            if not future.cancelled() and (outcome := future.result()) is not None:
                self._ended(outcome)
        return waiting

    def _ended(self, outcome: Outcome) -> None:
        self.outcomes[outcome.name] = outcome
        self.display.ended(outcome)

    def _compute(self, entry: Entry) -> Outcome | None:
        """Compute one run to its end, and return its outcome; None if the sweep was stopped before its start."""
        resume = self.folder.can_resume(entry)
        home, directory, log = self.folder.path, self.folder.run(entry), self.folder.log(entry)
        with self.guard:
            if self.stopping:
                return None
            if not resume:
                self.folder.set_aside(entry)
            for parent in (directory.parent, log.parent):
                parent.mkdir(parents=True, exist_ok=True)
            began = time.monotonic()
            with log.open("wb") as output:
                process = subprocess.Popen(
                    # Relative paths, so that the run's record does not depend on this machine.
                    self.command(self.folder.scene(entry).relative_to(home), directory.relative_to(home), resume),
                    cwd=home,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    env=environment(),
                    # A run that outlives this process keeps the sweep locked.
                    pass_fds=(self.lock,),
                    # Ctrl-C at the terminal must reach this process only, which signals each run once.
                    start_new_session=True,
                )
            self.active[entry.name] = (process, began)
        self.display.started(entry.name)
        returncode = process.wait()
        del self.active[entry.name]
        wall_s, status = time.monotonic() - began, Run(directory).status
        if returncode == 0 and status.state == "done":
            return Outcome(name=entry.name, status="done", wall_s=wall_s)
        if status.state == "interrupted" or returncode in (130, -signal.SIGINT):
            return Outcome(name=entry.name, status="interrupted", cause="interrupted", wall_s=wall_s)
        return Outcome(name=entry.name, status="failed", cause=status.cause or _cause(log, returncode), wall_s=wall_s)

    def _stop(self, waiting: set[Future[Outcome | None]]) -> None:
        """Stop all runs: send SIGINT, after `grace_s` SIGTERM, then SIGKILL; Ctrl-C skips a wait.

        `waiting` are the runs that have not ended; those that have not begun are cancelled.
        """
        with self.guard:
            self.stopping = True
        for future in waiting:
            future.cancel()
        if self.active:
            self.display.stopping(len(self.active))
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for process, _ in list(self.active.values()):
                with contextlib.suppress(ProcessLookupError):
                    process.send_signal(number)
            deadline = time.monotonic() + self.grace_s
            with contextlib.suppress(KeyboardInterrupt):
                while waiting and time.monotonic() < deadline:
                    waiting = self._collect(waiting, self.poll_s)
            if not self.active:
                break
        self._collect(waiting, 0.0)

    def _snapshot(self) -> Snapshot:
        now = time.monotonic()
        running = tuple((name, now - began, self._progress(name)) for name, (_, began) in list(self.active.items()))
        expected = {entry.name: entry.expected_s for entry in self.folder.entries}
        return Snapshot(
            total=len(self.folder.entries),
            ended=len(self.outcomes),
            failed=sum(outcome.missing for outcome in self.outcomes.values()),
            running=running,
            left_s=time_left(expected, self.outcomes, running, slots=self.slots),
        )

    def _progress(self, name: str) -> Progress:
        """Return the latest known progress of a run, which has no file of it any more when it is about to end."""
        progress = Run(self.folder.path / "runs" / name).progress
        if progress.time_s is not None:
            self.latest[name] = progress
        return self.latest.get(name, progress)


def time_left(
    expected: Mapping[str, float],
    outcomes: Mapping[str, Outcome],
    running: Sequence[tuple[str, float, Progress]],
    *,
    slots: int,
) -> float:
    """Return the expected wall time [s] until all runs have ended.

    Runs estimate their own time left once they have begun. Expected times of the others are corrected by the ratio of
    true to expected time of the finished runs, or of the running ones if none has finished.

    Args:
        expected: expected wall time of each run [s], by name.
        outcomes: outcomes of the runs that have ended, by name.
        running: name, wall time so far [s] and progress of each running run.
        slots: number of runs that are computed at once.
    """
    spent = [(o.wall_s, expected[o.name]) for o in outcomes.values() if o.status == "done"] or [
        (wall + progress.left_s, expected[name]) for name, wall, progress in running if progress.left_s is not None
    ]
    planned = sum(plan for _, plan in spent)
    pace = sum(wall for wall, _ in spent) / planned if planned > 0 else 1.0
    left = {name: pace * plan for name, plan in expected.items() if name not in outcomes}
    for name, wall, progress in running:
        left[name] = max(left.get(name, 0.0) - wall, 0.0) if progress.left_s is None else progress.left_s
    return max(sum(left.values()) / slots, *left.values(), 0.0)


def _cause(log: Path, returncode: int) -> str:
    """Return why a process that wrote no `failed.json` ended."""
    try:
        output = log.read_text(encoding="utf-8", errors="replace")
    except OSError:
        output = ""
    return cause_of(output, returncode) + ("" if output.strip() else f"; see {log}")


def cause_of(output: str, returncode: int) -> str:
    """Return why the process of a run ended: the error in its output, else exit status and last line."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    for line in lines:
        if line.startswith("smarticles: error: "):
            return line.removeprefix("smarticles: error: ")
    reason = f"exit status {returncode}" if returncode else "ended without done.json"
    if returncode < 0:
        name = signal.Signals(-returncode).name
        reason = f"killed by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")
    return f"{reason}: {lines[-1]}" if lines else f"{reason}, without output"
