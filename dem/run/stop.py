"""Stop a run at its next checkpoint after SIGUSR1, e.g. from a batch system before its time limit."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class StopRequestedError(Exception):
    """A run stopped after SIGUSR1, at a checkpoint or before it began, and can be continued."""


def hold() -> None:
    """Let SIGUSR1 wait until `release`, or until a `StopRequest` listens; for a process that still imports modules."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})


def release() -> None:
    """End the wait of SIGUSR1 that `hold` began; without a listener it ends the process."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGUSR1})


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
        release()
        try:
            yield
        finally:
            signal.signal(signal.SIGUSR1, before)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.came = True
