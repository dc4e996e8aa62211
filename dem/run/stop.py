"""Stop a run at its next checkpoint after SIGUSR1, e.g. from a batch system before its time limit."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class StopRequestedError(Exception):
    """A run stopped after SIGUSR1, at a checkpoint or before it began, and can be continued."""


class StopRequest:
    """A record of whether SIGUSR1 has come while `listening` was active."""

    came: bool = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Note SIGUSR1 during a block, instead of being killed by it; without effect outside the main thread."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = signal.signal(signal.SIGUSR1, self._note)
        try:
            yield
        finally:
            signal.signal(signal.SIGUSR1, before)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.came = True
