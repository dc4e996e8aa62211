"""SIGTERM and SIGHUP end a command as Ctrl-C does: in an orderly way."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _stop(number: int, _: FrameType | None) -> None:
    msg = f"stopped by {signal.Signals(number).name}"
    raise KeyboardInterrupt(msg)


def _pass_over(number: int, _: FrameType | None) -> None:
    """Ignore the signal in this process; a started process gets the default again, unlike SIG_IGN."""


@contextmanager
def orderly_stop() -> Iterator[None]:
    """Turn signals that end the process into KeyboardInterrupt; what nohup or a shell ignores stays ignored."""
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
