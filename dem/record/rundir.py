"""The run directory: claimed by one process at a time, with its log."""

from __future__ import annotations

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from dem.errors import InputError
from dem.record.names import LOCK, LOG, MANIFEST, is_partial


@contextmanager
def claimed(out: Path, *, resume: bool) -> Iterator[None]:
    """Hold a run directory while a run writes into it.

    The lock is the kernel's: it goes with the process that holds it, however that one ends, so none is ever stale.

    Args:
        out: the directory; made if needed.
        resume: whether a run is to go on in it; otherwise it must be empty.

    Raises:
        InputError: it holds something already, or nothing to resume, or another process writes into it.
    """
    _refuse_what_is_held(out, resume=resume)
    with _opened(out) as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.seek(0)
            msg = f"--out {out}: process {lock.read().strip() or 'unknown'} is running it; wait for it or stop it"
            raise InputError(msg) from None
        # Once more: another process may have run into it from beginning to end since the first look.
        _refuse_what_is_held(out, resume=resume)
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        yield


def _refuse_what_is_held(out: Path, *, resume: bool) -> None:
    """Make the directory if needed, and refuse it where it is not for this run; see `claimed`."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        held = sorted(path.name for path in out.iterdir() if path.name != LOCK and not is_partial(path.name))
    except OSError as error:
        msg = f"--out {out}: cannot be made ({error.strerror}); choose another directory"
        raise InputError(msg) from None
    if MANIFEST in held:
        if not resume:
            msg = (
                f"--out {out}: holds a run and is left as it is; go on with it by --resume, or choose another directory"
            )
            raise InputError(msg)
    elif held:
        what = f"no run to resume but files ({held[0]}, …)" if resume else f"files ({held[0]}, …)"
        msg = f"--out {out}: holds {what} and is left as it is; choose another directory"
        raise InputError(msg)
    elif resume:
        msg = f"--out {out}: holds no run to resume; leave --resume out to start one"
        raise InputError(msg)


def _opened(out: Path) -> TextIO:
    """The file that is locked.

    Raises:
        InputError: the directory cannot be written.
    """
    try:
        return (out / LOCK).open("a+")
    except OSError as error:
        msg = f"--out {out}: cannot be written ({error.strerror}); choose another directory, or allow it"
        raise InputError(msg) from None


def in_use(out: Path) -> bool:
    """Whether a process runs in a run directory at present."""
    try:
        with (out / LOCK).open() as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False  # nobody ever did, or it is not ours to look at
    return False


@contextmanager
def log_of(out: Path) -> Iterator[logging.Logger]:
    """The log of a run, `log.txt`; a resumed run appends to it."""
    log = logging.getLogger(f"smarticles.{out.resolve()}")
    log.setLevel(logging.INFO)
    log.propagate = False
    handler = logging.FileHandler(out / LOG, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    try:
        yield log
    finally:
        log.removeHandler(handler)
        handler.close()
