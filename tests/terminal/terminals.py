"""A terminal for tests: a pseudo-terminal whose screen is read by pyte."""

import codecs
import fcntl
import os
import pty
import signal
import struct
import subprocess
import termios
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Self

import pyte

PATIENCE_S = 120.0  # for a loaded machine; a test that passes waits for what it expects alone


class Terminal:
    """A process that runs in a pseudo-terminal, and the screen that a person sees.

    Lines that have left the screen at its top are in `history`.
    """

    def __init__(
        self,
        words: Sequence[str],
        *,
        folder: Path,
        columns: int = 80,
        rows: int = 24,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.master, slave = pty.openpty()
        self._set_size(columns, rows)
        self._screen = pyte.HistoryScreen(columns, rows, history=10_000)
        self._stream = pyte.Stream(self._screen)
        self._guard = threading.Lock()
        self.raw = ""  #: Everything that was written, escape codes included
        kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "COLUMNS", "LINES")}
        self.process = subprocess.Popen(
            # Ctrl-C and hanging up become signals, also where the tests run under `nohup`.
            ["env", "--default-signal=HUP", "setsid", "--ctty", *words],
            cwd=folder,
            env={**kept, "TERM": "xterm-256color", **(environment or {})},
            stdin=slave,
            stdout=slave,
            stderr=slave,
        )
        os.close(slave)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self._reader.join(10)

    def _read(self) -> None:
        decoder = codecs.getincrementaldecoder("utf-8")("replace")
        while True:
            try:
                data = os.read(self.master, 65536)
            except OSError:  # the last process has closed the terminal
                return
            if not data:
                return
            with self._guard:
                text = decoder.decode(data)
                self.raw += text
                self._stream.feed(text)

    @property
    def lines(self) -> list[str]:
        """What a person sees: lines of the screen without empty ones at its end."""
        with self._guard:
            shown = [line.rstrip() for line in self._screen.display]
        while shown and not shown[-1]:
            shown.pop()
        return shown

    @property
    def history(self) -> list[str]:
        """Lines that have left the screen, and those on the screen."""
        with self._guard:
            gone = ["".join(line[k].data for k in range(self._screen.columns)) for line in self._screen.history.top]
        return [line.rstrip() for line in gone] + self.lines

    def _set_size(self, columns: int, rows: int) -> None:
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def resize(self, columns: int, rows: int) -> None:
        """Change the size of the screen, as a person does at its window's corner."""
        with self._guard:
            self._screen.resize(rows, columns)
        self._set_size(columns, rows)  # the kernel sends SIGWINCH

    def press_ctrl_c(self) -> None:
        """Press Ctrl-C."""
        os.write(self.master, b"\x03")

    def close(self) -> None:
        """Close the window: the process receives SIGHUP, and its writes fail."""
        os.kill(self.process.pid, signal.SIGHUP)
        os.close(self.master)

    def wait_for(self, seen: Callable[[list[str]], bool]) -> list[str]:
        """Wait until the screen shows what `seen` returns True for; return its lines."""
        end = time.monotonic() + PATIENCE_S
        while not seen(lines := self.lines):
            over = time.monotonic() > end or (self.process.poll() is not None and not self._reader.is_alive())
            assert not over, "\n".join(["never seen; the screen:", *self.lines])
            time.sleep(0.05)
        return lines

    def end(self, patience_s: float = PATIENCE_S) -> int:
        """Wait until the process has ended, and return its exit status."""
        status = self.process.wait(patience_s)
        self._reader.join(10)
        return status
