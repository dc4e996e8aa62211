"""What a person sees of many runs: one live display at a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from dem.record.document import Progress

Ending = Literal["done", "kept", "failed", "interrupted"]
_MARKS = {"done": "✔", "kept": "=", "failed": "✘", "interrupted": "■"}


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

    def __str__(self) -> str:
        text = "finished before" if self.status == "kept" else self.status
        wall = f" after {duration(self.wall_s)}" if self.wall_s else ""
        return f"{self.name} {text}{wall}" + (f": {self.cause}" if self.status == "failed" else "")


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """All runs at one moment.

    Args:
        total: how many runs there are, kept ones included.
        ended: how many of them ended, however.
        failed: how many failed.
        running: name, wall time so far [s] and progress of those being computed.
        left_s: expected wall time left [s].
    """

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
        return [
            (name, said.phase or "", _simulated(said), "" if said.phi is None else f"φ {said.phi:.3f}", duration(wall))
            for name, wall, said in self.running
        ]


def duration(seconds: float) -> str:
    """`3:05` or `2:03:05`."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def _simulated(said: Progress) -> str:
    if said.time_s is None:
        return "starting"
    return f"{said.time_s:.2f}" + (f" of {said.end_s:.2f} s" if said.end_s is not None else " s")


class Display:
    """One line per run and a bar, redrawn in place, at a terminal; lines now and then elsewhere.

    Args:
        console: where to.
        interval_s: least time between two lines about the running ones [s].
    """

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
        """A run was started; a live display shows it anyway."""
        if not self._live:
            self._print(f"{name} started")

    def ended(self, outcome: Outcome) -> None:
        """A run ended, or was found finished."""
        self._print(f"{_MARKS[outcome.status]} {outcome}" if self._live else str(outcome))

    def update(self, snapshot: Snapshot) -> None:
        """Some time has passed."""
        if self._live:
            table, total = Table.grid(padding=(0, 2)), Table.grid(padding=(0, 2))
            for row in snapshot.rows:
                table.add_row(*map(Text, row))
            bar = ProgressBar(total=max(snapshot.total, 1), completed=snapshot.ended, width=30)
            total.add_row(bar, str(snapshot))
            self._live.update(Group(table, total))
        elif time.monotonic() - self._last >= self._interval_s:
            self._last = time.monotonic()
            runs = ", ".join(" ".join(filter(None, row[:-1])) for row in snapshot.rows)
            self._print(f"{snapshot}; {runs}")

    def stopping(self, count: int) -> None:
        """Some runs were asked to stop."""
        self._print(f"stopping {count} runs, which close their files; Ctrl-C again does not wait")

    def _print(self, line: str) -> None:
        # Names of runs are data, not markup.
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)
