"""Show how far computations are: bars on a terminal and in a notebook, lines of text elsewhere."""

from __future__ import annotations

import contextlib
import io
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self, TextIO, cast

from dem.terminal import bare, escaped, folded, spelling

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

#: A function that shows what is done, and how much of it: `progress("runs measured", 3, 12)`
Steps = Callable[[str, int, int], None]

INTERVAL_S = 30.0  # between two lines where there is no terminal
PATIENCE_S = 2.0  # before the first line, and before a bar appears: shorter work shows nothing
_REFRESHED_PER_S = 4.0
_BARS, _GAP = (6, 30), 2  # least and greatest width of bars, and gap between columns, in characters
_ECHO = 5  # characters that stay free: the terminal writes ^C there, and would else begin a new line
_CELL = 100  # characters, width of the output of a notebook's cell


def silent(_what: str, _done: int, _total: int) -> None:
    """Show nothing: the `Steps` of callers that want no progress."""


def duration(seconds: float) -> str:
    """Return a time [s] as text `3:05` or `2:03:05`."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


@dataclass(frozen=True, kw_only=True)
class Row:
    """How far one computation is."""

    label: str  #: What is computed, such as the name of a run
    fraction: float | None = None  #: Share of the work that is done [1]; None: unknown, no bar is drawn
    detail: str = ""  #: Numbers of the computation
    left_s: float | None = None  #: Expected wall time left [s]; None: unknown

    @property
    def left(self) -> str:
        """Expected time left as text, empty if it is unknown."""
        return "" if self.left_s is None else f"{duration(self.left_s)} left"

    def to_text(self) -> str:
        """Return one line of text."""
        share = "" if self.fraction is None else f"{100 * self.fraction:.0f} %"
        return ", ".join(filter(None, (f"{self.label} {share}".rstrip(), self.detail, self.left)))


class Display:
    """Shows rows about computations, and lines that stay.

    A terminal shows the rows below all other lines and redraws them; a notebook shows them in the output of the cell.
    Elsewhere the rows become a line of text after 2 s and then every 30 s. Inside the context, lines that are written
    to standard error appear above the rows.
    """

    def __init__(
        self, stream: TextIO | None = None, *, interval_s: float = INTERVAL_S, patience_s: float = PATIENCE_S
    ) -> None:
        """Make a display that writes to a stream, by default standard error.

        `interval_s`: time between two lines of text [s]; `patience_s`: time before the rows appear [s].
        """
        self._stream = bare(stream or sys.stderr)
        self._interval_s, self._patience_s = interval_s, patience_s
        self._rows: tuple[Row, ...] = ()
        self._began = self._drawn = time.monotonic()
        self._ended = threading.Event()
        self._stack = contextlib.ExitStack()
        self._spoken = False
        self._live: Any = None
        self._cell: Any = None

    @property
    def redraws(self) -> bool:
        """Whether rows are redrawn in place."""
        return self._live is not None or self._cell is not None

    def __enter__(self) -> Self:
        """Begin to show rows."""
        from rich.console import Console  # noqa: PLC0415  (takes 0.1 s)

        self._began = time.monotonic()
        self._stack.enter_context(spelling(self._stream))
        # FORCE_COLOR and the like must not make rich redraw lines of a file.
        terminal = None if Console().is_jupyter else self._stream.isatty()
        console = Console(file=self._stream, force_terminal=terminal, emoji=False, markup=False, highlight=False)
        if console.is_jupyter:
            from IPython.display import HTML, display  # noqa: PLC0415  (there in notebooks alone)

            self._cell = display(HTML(""), display_id=True)
        elif console.is_terminal and not console.is_dumb_terminal:
            from rich.live import Live  # noqa: PLC0415

            self._live = Live(
                get_renderable=lambda: self._drawing(console),
                console=console,
                refresh_per_second=_REFRESHED_PER_S,
                transient=True,
                redirect_stdout=False,  # they would obey control characters
                redirect_stderr=False,
            )
            self._stack.enter_context(self._live)
            above = self._stack.enter_context(_Above(self.print))
            self._stack.enter_context(redirect_stderr(cast(TextIO, above)))
        else:
            writer = threading.Thread(target=self._write_lines, daemon=True)
            writer.start()
            self._stack.callback(writer.join)  # no line may follow what is printed next
        return self

    def __exit__(self, *exception: object) -> None:
        """Remove the rows."""
        self._ended.set()
        # A terminal that was closed must not hide why the computation ended.
        with contextlib.suppress(OSError):
            self._stack.close()
        if self._cell is not None:
            self._update_cell("")
        self._live = self._cell = None

    def update(self, *rows: Row) -> None:
        """Show these rows in place of the previous ones."""
        self._rows = rows
        now = time.monotonic()
        if self._cell is not None and now - self._drawn > 1 / _REFRESHED_PER_S:
            self._drawn = now
            self._update_cell(self._html())

    def print(self, line: str) -> None:
        """Write a line that stays, above the rows."""
        self._spoken = True
        if self._live is not None:
            self._live.console.print(folded(escaped(line), width=self._live.console.width), soft_wrap=True)
        else:
            # Notebooks colour standard error like a failure.
            print(escaped(line), file=self._stream if self._cell is None else sys.stdout, flush=True)

    def _write_lines(self) -> None:
        wait, first = self._patience_s, True
        while not self._ended.wait(wait):
            due = not (first and self._spoken)  # whoever has seen a line waits for the next
            wait, first = self._interval_s, False
            if self._rows and due:
                with contextlib.suppress(OSError, ValueError):  # a closed terminal or file
                    self.print("; ".join(row.to_text() for row in self._rows))

    def _drawing(self, console: Console) -> RenderableType:
        from rich.constrain import Constrain  # noqa: PLC0415
        from rich.progress_bar import ProgressBar  # noqa: PLC0415
        from rich.table import Table  # noqa: PLC0415
        from rich.text import Text  # noqa: PLC0415

        elapsed = time.monotonic() - self._began
        if elapsed < self._patience_s or not self._rows:
            return Text("")
        cells = [
            (
                row,
                "  ".join(filter(None, ("" if row.fraction is None else f"{100 * row.fraction:3.0f} %", row.detail))),
                row.left or f"{duration(elapsed)} so far",
            )
            for row in self._rows
        ]
        # The time left stays whole; long labels are cut before it, and then details. Bars have what texts leave free.
        room = console.width - _ECHO
        lefts = max(len(left) for *_, left in cells)
        labels = min(max(len(row.label) for row, *_ in cells), room // 3)
        others = labels + lefts + 3 * _GAP
        details = max(min(max(len(detail) for _, detail, _ in cells), room - others - _BARS[0]), 1)
        width = min(max(room - others - details, _BARS[0]), _BARS[1])
        grid = Table.grid(padding=(0, _GAP))
        for most in (labels, None, details, lefts):
            grid.add_column(no_wrap=True, overflow="ellipsis", max_width=most)
        for row, detail, left in cells:
            bar = "" if row.fraction is None else ProgressBar(1.0, row.fraction, width=width)
            grid.add_row(Text(escaped(row.label)), bar, Text(escaped(detail)), Text(left))
        return Constrain(grid, room)

    def _html(self) -> str:
        from rich.console import Console  # noqa: PLC0415

        console = Console(file=io.StringIO(), record=True, width=_CELL, force_jupyter=False, force_terminal=True)
        console.print(self._drawing(console))
        return console.export_html(inline_styles=True, code_format="<pre>{code}</pre>")

    def _update_cell(self, text: str) -> None:
        from IPython.display import HTML  # noqa: PLC0415

        self._cell.update(HTML(text))


class NoDisplay(Display):
    """Shows nothing."""

    def __enter__(self) -> Self:
        """Show nothing."""
        return self

    def print(self, line: str) -> None:
        """Write nothing."""

    def update(self, *rows: Row) -> None:
        """Show nothing."""


class _Above(io.TextIOBase):
    """A stream whose lines are printed above the rows of a display."""

    def __init__(self, print_line: Callable[[str], None]) -> None:
        super().__init__()
        self._print, self._begun = print_line, ""

    def write(self, text: str) -> int:
        *lines, self._begun = (self._begun + text).split("\n")
        for line in lines:
            self._print(line)
        return len(text)

    def isatty(self) -> bool:
        return True

    def close(self) -> None:
        last, self._begun = self._begun, ""
        if last:
            self._print(last)
        super().close()


@contextmanager
def progress_of(label: str) -> Iterator[Steps]:
    """Show a row about a computation while the context lasts; yield a function that is called after each part of it.

    `label` is shown until the first call. The time left is estimated from that of the parts so far.
    """
    with Display() as display:
        display.update(Row(label=label))
        yield _Counted(display)


class _Counted:
    """Shows parts of a computation as they are done; estimates the time that is left from them."""

    def __init__(self, display: Display) -> None:
        self._display, self._what, self._began, self._first = display, "", time.monotonic(), 0

    def __call__(self, what: str, done: int, total: int) -> None:
        now = time.monotonic()
        if what != self._what:
            self._what, self._began, self._first = what, now, done
        since, left = done - self._first, None
        if since > 0 and done < total:  # after the last part, others may follow
            left = (now - self._began) * (total - done) / since
        fraction = done / total if total else None
        self._display.update(Row(label=what, fraction=fraction, detail=f"{done} of {total}", left_s=left))
