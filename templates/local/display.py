"""How many runs look to a person: one live display at a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from templates.local.runner import Display, Outcome, Snapshot, Standing
from templates.sweep.folder import Entry

_MARKS = {"done": "[green]✔[/]", "kept": "[dim]=[/]", "failed": "[red]✘[/]", "interrupted": "■"}


def duration(seconds: float | None) -> str:
    """`3:05` or `2:03:05`; `?` when unknown."""
    if seconds is None:
        return "?"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def _simulated(run: Standing) -> str:
    if run.time_s is None:
        return "starting"
    end = f" of {run.end_s:.2f}" if run.end_s is not None else ""
    return f"{run.time_s:.2f}{end} s"


def _phi(run: Standing) -> str:
    return "" if run.phi is None else f"φ {run.phi:.3f}"


def _totals(snapshot: Snapshot) -> str:
    failed = f", {snapshot.failed} failed" if snapshot.failed else ""
    return f"{snapshot.ended} of {snapshot.total} runs ended{failed}, time left {duration(snapshot.left_s)}"


def _ending(outcome: Outcome) -> str:
    text = "finished before" if outcome.status == "kept" else outcome.status
    wall = f" after {duration(outcome.wall_s)}" if outcome.wall_s else ""
    cause = f": {outcome.cause}" if outcome.status == "failed" else ""
    return f"{outcome.name} {text}{wall}{cause}"


def _stopping(count: int) -> str:
    return f"stopping {count} runs, which close their files; Ctrl-C again does not wait"


class LiveDisplay:
    """One line per active run and a bar for all, redrawn in place; ended runs scroll away above."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live = Live(console=console, refresh_per_second=4, transient=True)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._live.stop()

    def started(self, entry: Entry) -> None:
        """Nothing: the next update shows the run."""

    def ended(self, outcome: Outcome) -> None:
        """Print how the run ended."""
        line = Text.from_markup(f"{_MARKS[outcome.status]} ").append(_ending(outcome))
        self._console.print(line)

    def update(self, snapshot: Snapshot) -> None:
        """Redraw."""
        self._live.update(self.picture(snapshot))

    def stopping(self, count: int) -> None:
        """Print what is waited for."""
        self._console.print(_stopping(count))

    @staticmethod
    def picture(snapshot: Snapshot) -> Group:
        """What is drawn."""
        table = Table.grid(padding=(0, 2))
        for run in snapshot.running:
            table.add_row(run.name, run.phase or "", _simulated(run), _phi(run), duration(run.wall_s))
        bar = ProgressBar(total=max(snapshot.total, 1), completed=snapshot.ended, width=30)
        total = Table.grid(padding=(0, 2))
        total.add_row(bar, _totals(snapshot))
        return Group(table, total)


class PlainDisplay:
    """Lines for logs and pipes: starts, ends, and the state of all runs now and then.

    Args:
        console: where the lines go.
        interval_s: least time between two reports on the state [s].
    """

    def __init__(self, console: Console, interval_s: float = 30.0) -> None:
        self._console = console
        self._interval_s = interval_s
        self._last = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def started(self, entry: Entry) -> None:
        """Print that the run started."""
        self._print(f"{entry.name} started")

    def ended(self, outcome: Outcome) -> None:
        """Print how the run ended."""
        self._print(_ending(outcome))

    def update(self, snapshot: Snapshot) -> None:
        """Print the state of all runs, if it is time."""
        if time.monotonic() - self._last < self._interval_s:
            return
        self._last = time.monotonic()
        runs = ", ".join(
            " ".join(part for part in (run.name, run.phase, _simulated(run), _phi(run)) if part)
            for run in snapshot.running
        )
        self._print(f"{_totals(snapshot)}; {runs}")

    def stopping(self, count: int) -> None:
        """Print what is waited for."""
        self._print(_stopping(count))

    def _print(self, line: str) -> None:
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)


def display_for(console: Console) -> Display:
    """The live display at a terminal, plain lines elsewhere."""
    return LiveDisplay(console) if console.is_terminal else PlainDisplay(console)
