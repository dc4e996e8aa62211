"""Run many runs on this machine: one process each, at most one per core, the longest first.

A sweep may want its runs seed by seed; then the longest of each seed come first. A run that fails does not stop the
others. Ctrl-C stops all of them in an orderly way.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Literal, Protocol

from dem.engine.cores import usable_cores
from templates.local.estimate import PhaseClock, time_left
from templates.sweep.files import read_json
from templates.sweep.folder import Entry, Folder

Ending = Literal["done", "kept", "failed", "interrupted"]

RunCommand = Callable[[Path, Path, bool], Sequence[str]]
"""(scene file, run directory, whether to resume) -> the command of one run, started in the sweep's directory."""

# Threads that find no free core spin: one thread per run, set before its interpreter starts.
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a run ended.

    Args:
        name: its name.
        status: `kept` was finished before.
        cause: why it failed, or None.
        wall_s: wall time [s].
    """

    name: str
    status: Ending
    cause: str | None = None
    wall_s: float = 0.0

    @property
    def missing(self) -> bool:
        """Whether the run still has no result."""
        return self.status not in ("done", "kept")


@dataclass(frozen=True, kw_only=True)
class Standing:
    """Where a run that is being computed stands; None is unknown.

    Args:
        name: its name.
        wall_s: wall time so far [s].
        expected_s: expected wall time [s].
        phase: type of the phase it is in.
        time_s: simulated time [s].
        end_s: simulated time at which the phase ends [s].
        left_in_phase_s: wall time until then, at the present pace [s]; 0 if unknown.
        phi: packing fraction so far.
    """

    name: str
    wall_s: float
    expected_s: float
    phase: str | None = None
    time_s: float | None = None
    end_s: float | None = None
    left_in_phase_s: float = 0.0
    phi: float | None = None


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """All runs at one moment.

    Args:
        total: how many runs there are, kept ones included.
        ended: how many of them ended, however.
        failed: how many failed.
        running: those being computed.
        left_s: wall time left [s], as far as can be told.
    """

    total: int
    ended: int
    failed: int
    running: tuple[Standing, ...]
    left_s: float


class Display(Protocol):
    """Shows a person how the runs go."""

    def __enter__(self) -> Display: ...

    def __exit__(self, *exception: object) -> None: ...

    def started(self, entry: Entry) -> None:
        """A run was started."""

    def ended(self, outcome: Outcome) -> None:
        """A run ended, or was found finished."""

    def update(self, snapshot: Snapshot) -> None:
        """Some time has passed."""

    def stopping(self, count: int) -> None:
        """So many runs were asked to stop."""


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
        runner = _Runner(
            folder=folder,
            display=display,
            command=command,
            slots=slots or slots_here(),
            timing=timing or Timing(),
            inherited=(lock,),
        )
        outcomes = {outcome.name: outcome for outcome in runner.run()}
    return [outcomes[entry.name] for entry in folder.entries]


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Intervals of the runner [s].

    Args:
        poll_s: between looks at the processes.
        grace_s: between asking a process to stop and making it.
    """

    poll_s: float = 0.25
    grace_s: float = 60.0


@dataclass(kw_only=True)
class _Active:
    entry: Entry
    process: subprocess.Popen[bytes]
    output: IO[bytes]
    started: float
    clock: PhaseClock = field(default_factory=PhaseClock)

    @property
    def wall_s(self) -> float:
        return time.monotonic() - self.started


@dataclass(kw_only=True)
class _Runner:
    folder: Folder
    display: Display
    command: RunCommand
    slots: int
    timing: Timing
    inherited: tuple[int, ...]
    pending: list[Entry] = field(default_factory=list)
    active: list[_Active] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    # (expected, measured) wall time [s] of the runs that finished here.
    finished: list[tuple[float, float]] = field(default_factory=list)

    def run(self) -> list[Outcome]:
        for entry in self.folder.entries:
            if self.folder.is_done(entry):
                self._ended(Outcome(name=entry.name, status="kept"))
            else:
                self.pending.append(entry)
        self.pending = self.folder.in_order_of_start(self.pending)
        try:
            while self.pending or self.active:
                while self.pending and len(self.active) < self.slots:
                    self._start(self.pending.pop(0))
                time.sleep(self.timing.poll_s)
                self._collect()
                self.display.update(self._snapshot())
        finally:
            # Ctrl-C, or a display that failed: no process outlives its runner.
            self._stop()
        return self.outcomes

    def _start(self, entry: Entry) -> None:
        resume = self.folder.can_resume(entry)
        if not resume:
            self.folder.set_aside(entry)
        home, directory, log = self.folder.path, self.folder.run(entry), self.folder.log(entry)
        for parent in (directory.parent, log.parent):
            parent.mkdir(parents=True, exist_ok=True)
        output = log.open("wb")
        try:
            process = subprocess.Popen(
                # Seen from the sweep's directory, so that a run's record does not name this machine's folders.
                self.command(self.folder.scene(entry).relative_to(home), directory.relative_to(home), resume),
                cwd=home,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment(),
                pass_fds=self.inherited,
                # Ctrl-C at the terminal reaches this process only, which then asks each run once.
                start_new_session=True,
            )
        except BaseException:
            output.close()
            raise
        started = time.monotonic()
        self.active.append(_Active(entry=entry, process=process, output=output, started=started))
        self.display.started(entry)

    def _ended(self, outcome: Outcome) -> None:
        self.outcomes.append(outcome)
        self.display.ended(outcome)

    def _collect(self) -> None:
        for run in [run for run in self.active if run.process.poll() is not None]:
            self.active.remove(run)
            run.output.close()
            outcome = self._outcome(run)
            if outcome.status == "done":
                self.finished.append((run.entry.expected_s, outcome.wall_s))
            self._ended(outcome)

    def _outcome(self, run: _Active) -> Outcome:
        name, directory = run.entry.name, self.folder.run(run.entry)
        returncode, wall_s = run.process.returncode, run.wall_s
        if returncode == 0 and (directory / "done.json").is_file():
            return Outcome(name=name, status="done", wall_s=wall_s)
        failed = read_json(directory / "failed.json") or {}
        if failed.get("status") == "interrupted" or returncode in (130, -signal.SIGINT):
            return Outcome(name=name, status="interrupted", cause="interrupted", wall_s=wall_s)
        cause = str(failed.get("cause") or _last_words(self.folder.log(run.entry), returncode))
        return Outcome(name=name, status="failed", cause=cause, wall_s=wall_s)

    def _stop(self) -> None:
        """Ask every run to stop, wait, insist; a second Ctrl-C does not wait."""
        if self.active:
            self.display.stopping(len(self.active))
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for run in self.active:
                with contextlib.suppress(ProcessLookupError):
                    run.process.send_signal(number)
            deadline = time.monotonic() + self.timing.grace_s
            # A second Ctrl-C means: do not wait.
            with contextlib.suppress(KeyboardInterrupt):
                while self.active and time.monotonic() < deadline:
                    self._collect()
                    time.sleep(min(0.05, self.timing.poll_s))
            if not self.active:
                return

    def _progress(self, run: _Active) -> Standing:
        said = read_json(self.folder.run(run.entry) / "progress.json") or {}

        def number(key: str) -> float | None:
            value = said.get(key)
            return float(value) if isinstance(value, int | float) else None

        phase, wall_s = said.get("phase"), run.wall_s
        time_s, end_s = number("time_s"), number("end_s")
        return Standing(
            name=run.entry.name,
            wall_s=wall_s,
            expected_s=run.entry.expected_s,
            phase=phase if isinstance(phase, str) else None,
            time_s=time_s,
            end_s=end_s,
            left_in_phase_s=run.clock.left(phase=said.get("phase_index"), wall_s=wall_s, time_s=time_s, end_s=end_s),
            phi=number("phi"),
        )

    def _snapshot(self) -> Snapshot:
        running = tuple(self._progress(run) for run in self.active)
        return Snapshot(
            total=len(self.folder.entries),
            ended=len(self.outcomes),
            failed=sum(outcome.missing for outcome in self.outcomes),
            running=running,
            left_s=time_left(
                self.finished,
                [(run.expected_s, run.wall_s, run.left_in_phase_s) for run in running],
                [entry.expected_s for entry in self.pending],
                self.slots,
            ),
        )


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
