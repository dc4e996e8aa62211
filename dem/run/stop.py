"""Stop a run at its next checkpoint after SIGUSR1, e.g. from a batch system before its time limit."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class StopRequestedError(Exception):
    """A run stopped after SIGUSR1, at a checkpoint or before it began, and can be continued."""


class StopRequest:
    """A request to stop: `came` is true once SIGUSR1 has come while `listening` was active."""

    came: bool = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Context manager: note in `came` that SIGUSR1 has come, instead of being killed by it.

        Outside the main thread it has no effect.
        """
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
