"""Run many runs on this machine: one process each, at most one per core, the longest first.

A sweep may want its runs seed by seed; then the longest of each seed come first. A run that fails does not stop the
others. Ctrl-C stops all of them in an orderly way.
"""

from __future__ import annotations

import contextlib
import heapq
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

from dem.engine.cores import usable_cores
from dem.record.run import Run
from templates.local.display import Display, Outcome, Snapshot
from templates.sweep.folder import Entry, Folder

RunCommand = Callable[[Path, Path, bool], Sequence[str]]
"""(scene file, run directory, whether to resume) -> the command of one run, started in the sweep's directory."""

# Threads that find no free core spin: one thread per run, set before its interpreter starts.
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Intervals of the runner [s].

    Args:
        poll_s: between updates of the display.
        grace_s: between asking a process to stop and making it.
    """

    poll_s: float = 0.25
    grace_s: float = 60.0


def slots_here() -> int:
    """How many runs this process may have at once: one per core it is allowed to use."""
    return usable_cores()


def smarticles_command(scene: Path, directory: Path, resume: bool) -> tuple[str, ...]:
    """The command that runs one scene into one run directory, with this interpreter; its words are recorded there."""
    # -P: a file called like a library in the working directory must not be imported.
    return (
        *(sys.executable, "-P", "-m", "smarticles", "run", str(scene), "--out", str(directory)),
        *(("--resume",) if resume else ()),
    )


def run_folder(
    folder: Folder,
    display: Display,
    *,
    slots: int | None = None,
    command: RunCommand = smarticles_command,
    timing: Timing | None = None,
) -> list[Outcome]:
    """Run what a sweep's directory is missing.

    Finished runs are kept. Unfinished ones go on from their checkpoint; those without one, and those that failed, are
    set aside and run anew.

    Args:
        folder: the sweep's directory.
        display: shows how it goes.
        slots: how many runs at once; by default one per core.
        command: the command of one run.
        timing: intervals of the runner.

    Returns:
        One outcome per run, in the manifest's order.

    Raises:
        InputError: another process computes this sweep already.
        KeyboardInterrupt: Ctrl-C; all runs were stopped.
    """
    with folder.lock() as lock, display:
        runner = _Runner(folder, display, command, slots or slots_here(), timing or Timing(), lock)
        runner.run()
    return [runner.outcomes[entry.name] for entry in folder.entries]


@dataclass
class _Runner:
    folder: Folder
    display: Display
    command: RunCommand
    slots: int
    timing: Timing
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
                    waiting = self._collect(waiting, self.timing.poll_s)
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
        """Run one run to its end; None where it was not started any more."""
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
        return self._outcome(entry, returncode, time.monotonic() - began)

    def _outcome(self, entry: Entry, returncode: int, wall_s: float) -> Outcome:
        status = Run(self.folder.run(entry)).status
        if returncode == 0 and status.state == "done":
            return Outcome(name=entry.name, status="done", wall_s=wall_s)
        if status.state == "interrupted" or returncode in (130, -signal.SIGINT):
            return Outcome(name=entry.name, status="interrupted", cause="interrupted", wall_s=wall_s)
        cause = status.cause or _last_words(self.folder.log(entry), returncode)
        return Outcome(name=entry.name, status="failed", cause=cause, wall_s=wall_s)

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
            deadline = time.monotonic() + self.timing.grace_s
            with contextlib.suppress(KeyboardInterrupt):
                while waiting and time.monotonic() < deadline:
                    waiting = self._collect(waiting, self.timing.poll_s)
            if not self.active:
                break
        self._collect(waiting, 0.0)

    def _snapshot(self) -> Snapshot:
        now = time.monotonic()
        running = [(name, now - began) for name, (_, began) in list(self.active.items())]
        return Snapshot(
            total=len(self.folder.entries),
            ended=len(self.outcomes),
            failed=sum(outcome.missing for outcome in self.outcomes.values()),
            running=tuple((name, wall, Run(self.folder.path / "runs" / name).progress) for name, wall in running),
            left_s=self._left(dict(running)),
        )

    def _left(self, running: dict[str, float]) -> float:
        """Expected wall time left [s], by the pace of those that finished."""
        expected = {entry.name: entry.expected_s for entry in self.folder.entries}
        done = [outcome for outcome in self.outcomes.values() if outcome.status == "done"]
        planned = sum(expected[outcome.name] for outcome in done)
        pace = sum(outcome.wall_s for outcome in done) / planned if planned > 0 else 1.0
        free = [max(pace * expected[name] - wall, 0.0) for name, wall in running.items()]
        free += [0.0] * max(self.slots - len(free), 0)
        heapq.heapify(free)
        for name, wall in expected.items():
            if name not in running and name not in self.outcomes:
                heapq.heapreplace(free, free[0] + pace * wall)
        return max(free)


def environment() -> dict[str, str]:
    """Variables of a process that runs one scene: one thread, and the code that this process uses."""
    environment = {**os.environ, **ONE_THREAD}
    # Runs start in another directory.
    paths = [os.path.abspath(path) for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]  # noqa: PTH100
    root = Path(__file__).resolve().parents[2]
    if "site-packages" not in root.parts and "dist-packages" not in root.parts:
        # A source tree that is not installed: runs use the same code as this process.
        paths.insert(0, str(root))
    if paths:
        environment["PYTHONPATH"] = os.pathsep.join(paths)
    return environment


def _last_words(log: Path, returncode: int) -> str:
    """Why a process without `failed.json` ended: its error line, else its end and last line."""
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("smarticles: error: "):
            return line.removeprefix("smarticles: error: ")
    if returncode < 0:
        name = signal.Signals(-returncode).name
        reason = f"killed by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")
    elif returncode == 0:
        reason = "ended without done.json"
    else:
        reason = f"exit status {returncode}"
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    return f"{reason}: {last}" if last else f"{reason}, without a word; see {log}"
