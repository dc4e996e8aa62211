"""Run many runs on this machine: one process each, at most one per core, the longest first.

A sweep may want its runs seed by seed; then the longest of each seed come first. A run that fails does not stop the
others. Ctrl-C stops all of them, and lets each close its files.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from dem.engine.cores import usable_cores
from dem.record.document import Progress
from dem.record.run import Run
from templates.sweep.folder import Entry, Folder

RunCommand = Callable[[Path, Path, bool], Sequence[str]]
"""(scene file, run directory, whether to resume) -> the command of one run, started in the sweep's directory."""

# Threads that find no free core spin: one thread per run, set before its interpreter starts.
_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
_MARKS = {"done": "✔", "kept": "=", "failed": "✘", "interrupted": "■"}


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a run ended; `kept`: it was finished before."""

    name: str
    status: Literal["done", "kept", "failed", "interrupted"]
    cause: str | None = None
    wall_s: float = 0.0

    @property
    def missing(self) -> bool:
        """Whether the run still has no result."""
        return self.status not in ("done", "kept")

    def __str__(self) -> str:
        text = "finished before" if self.status == "kept" else self.status
        wall = f" after {duration(self.wall_s)}" if self.wall_s else ""
        return f"{self.name} {text}{wall}" + (f": {self.cause}" if self.status == "failed" else "")


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """All runs at one moment; `running` has name, wall time so far [s] and progress of those being computed."""

    total: int
    ended: int
    failed: int
    running: tuple[tuple[str, float, Progress], ...]
    left_s: float

    def __str__(self) -> str:
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.ended} of {self.total} runs ended{failed}, time left {duration(self.left_s)}"

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Name, phase, simulated time, packing fraction and wall time of the running ones."""
        rows: list[tuple[str, ...]] = []
        for name, wall, progress in self.running:
            end = " s" if progress.end_s is None else f" of {progress.end_s:.2f} s"
            simulated = "starting" if progress.time_s is None else f"{progress.time_s:.2f}{end}"
            phi = "" if progress.phi is None else f"φ {progress.phi:.3f}"
            rows.append((name, progress.phase or "", simulated, phi, duration(wall)))
        return rows


def duration(seconds: float) -> str:
    """Format a time as `3:05` or `2:03:05`."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


class Display:
    """One line per run and a bar, redrawn in place, at a terminal; elsewhere a line at intervals [s]."""

    def __init__(self, console: Console, interval_s: float = 30.0) -> None:
        self._console = console
        self._live = Live(console=console, refresh_per_second=4, transient=True) if console.is_terminal else None
        self._interval_s = interval_s
        self._last = time.monotonic()

    def __enter__(self) -> Self:
        if self._live:
            self._live.start()
        return self

    def __exit__(self, *exception: object) -> None:
        if self._live:
            self._live.stop()

    def started(self, name: str) -> None:
        """Report that a run was started; a live display shows it anyway."""
        if not self._live:
            self._print(f"{name} started")

    def ended(self, outcome: Outcome) -> None:
        """Report that a run ended, or was found finished."""
        self._print(f"{_MARKS[outcome.status]} {outcome}" if self._live else str(outcome))

    def update(self, snapshot: Snapshot) -> None:
        """Show the runs at this moment."""
        if self._live:
            table, total = Table.grid(padding=(0, 2)), Table.grid(padding=(0, 2))
            for row in snapshot.rows:
                table.add_row(*map(Text, row))
            total.add_row(ProgressBar(max(snapshot.total, 1), snapshot.ended, width=30), str(snapshot))
            self._live.update(Group(table, total))
        elif time.monotonic() - self._last >= self._interval_s:
            self._last = time.monotonic()
            runs = ", ".join(" ".join(filter(None, row[:-1])) for row in snapshot.rows)
            self._print(f"{snapshot}; {runs}")

    def stopping(self, count: int) -> None:
        """Report that some runs were asked to stop."""
        self._print(f"stopping {count} runs, which close their files; Ctrl-C again does not wait")

    def _print(self, line: str) -> None:
        # Names of runs are data, not markup.
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)


def smarticles_command(scene: Path, directory: Path, resume: bool) -> tuple[str, ...]:
    """Return the command that runs one scene into one run directory, with this interpreter."""
    # -P: a file called like a library in the working directory must not be imported.
    words = (sys.executable, "-P", "-m", "smarticles", "run", str(scene), "--out", str(directory))
    return (*words, "--resume") if resume else words


def environment() -> dict[str, str]:
    """Return variables of a process that runs one scene: one thread, and the code that this process uses."""
    environment = {**os.environ, **_ONE_THREAD}
    # Runs start in another directory.
    paths = [os.path.abspath(path) for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]  # noqa: PTH100
    root = Path(__file__).resolve().parents[1]
    if "site-packages" not in root.parts and "dist-packages" not in root.parts:
        # A source tree that is not installed: runs use the same code as this process.
        paths.insert(0, str(root))
    if paths:
        environment["PYTHONPATH"] = os.pathsep.join(paths)
    return environment


def run_folder(
    folder: Folder,
    display: Display,
    *,
    slots: int | None = None,
    command: RunCommand = smarticles_command,
    poll_s: float = 0.25,
    grace_s: float = 60.0,
) -> list[Outcome]:
    """Run what a sweep's directory is missing; return one outcome per run, in the manifest's order.

    Finished runs are kept. Unfinished ones go on from their checkpoint; those without one, and those that failed, are
    set aside and run anew.

    Args:
        slots: how many runs at once; by default one per core.
        poll_s: between updates of the display [s].
        grace_s: between asking a process to stop and making it stop [s].

    Raises:
        InputError: another process computes this sweep already.
        KeyboardInterrupt: Ctrl-C; all runs were stopped.
    """
    with folder.lock() as lock, display:
        runner = _Runner(folder, display, command, slots or usable_cores(), poll_s, grace_s, lock)
        runner.run()
    return [runner.outcomes[entry.name] for entry in folder.entries]


@dataclass
class _Runner:
    folder: Folder
    display: Display
    command: RunCommand
    slots: int
    poll_s: float
    grace_s: float
    lock: int
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    active: dict[str, tuple[subprocess.Popen[bytes], float]] = field(default_factory=dict)
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
                # Ctrl-C, or a display that failed: no process outlives its runner.
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
        """Run one run to its end; return None where it was not started any more."""
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
                    # Seen from the sweep's directory, so that a run's record does not name this machine's folders.
                    self.command(self.folder.scene(entry).relative_to(home), directory.relative_to(home), resume),
                    cwd=home,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    env=environment(),
                    # A run that outlives its runner keeps the sweep locked.
                    pass_fds=(self.lock,),
                    # Ctrl-C at the terminal reaches this process only, which then asks each run once.
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
        """Ask every run to stop, wait, insist; a second Ctrl-C does not wait."""
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
        running = {name: now - began for name, (_, began) in list(self.active.items())}
        return Snapshot(
            total=len(self.folder.entries),
            ended=len(self.outcomes),
            failed=sum(outcome.missing for outcome in self.outcomes.values()),
            running=tuple(
                (name, wall, Run(self.folder.path / "runs" / name).progress) for name, wall in running.items()
            ),
            left_s=self._left(running),
        )

    def _left(self, running: dict[str, float]) -> float:
        """Return the expected wall time left [s], by the pace of the runs that finished."""
        expected = {entry.name: entry.expected_s for entry in self.folder.entries}
        done = [outcome for outcome in self.outcomes.values() if outcome.status == "done"]
        planned = sum(expected[outcome.name] for outcome in done)
        pace = sum(outcome.wall_s for outcome in done) / planned if planned > 0 else 1.0
        left = [
            max(pace * wall - running.get(name, 0.0), 0.0)
            for name, wall in expected.items()
            if name not in self.outcomes
        ]
        return max(sum(left) / self.slots, *left, 0.0)


def _cause(log: Path, returncode: int) -> str:
    """Return why a process without `failed.json` ended: its error line, else its end and last line."""
    try:
        lines = [
            line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()
        ]
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("smarticles: error: "):
            return line.removeprefix("smarticles: error: ")
    reason = f"exit status {returncode}" if returncode else "ended without done.json"
    if returncode < 0:
        name = signal.Signals(-returncode).name
        reason = f"killed by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")
    return f"{reason}: {lines[-1]}" if lines else f"{reason}, without a word; see {log}"
