"""SIGTERM and SIGHUP end a command as Ctrl-C does: in an orderly way."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

TO_BE_CONTINUED = 75
"""Exit status of a run that SIGUSR1 stopped at a checkpoint; EX_TEMPFAIL of sysexits.h."""

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _stop(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _pass_over(_number: int, _frame: FrameType | None) -> None:
    """Ignore a signal here only: unlike SIG_IGN, this is not handed down to started processes."""


@contextmanager
def orderly_stop() -> Iterator[None]:
    """Turn signals that end the process into KeyboardInterrupt.

    What the process was told to ignore, by nohup or by a shell's `&`, stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    try:
        for number, handler in before.items():
            signal.signal(number, _pass_over if handler is signal.SIG_IGN else _stop)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
