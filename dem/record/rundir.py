"""The lock and the log of a run directory: one process at a time writes into it."""

import fcntl
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from dem.errors import InputError, RunError
from dem.record.names import LOCK, LOG, MANIFEST, is_partial


@dataclass(frozen=True)
class Claim:
    """A locked run directory."""

    out: Path
    lock: TextIO  #: The open lock file

    @property
    def held(self) -> bool:
        """Whether the path still leads to the locked directory: false if it was deleted, moved or replaced."""
        try:
            present = (self.out / LOCK).stat()
        except OSError:
            return False
        return os.path.samestat(present, os.fstat(self.lock.fileno()))

    def check(self) -> None:
        """Raise RunError if the path no longer leads to the locked directory, or the manifest is missing."""
        if not self.held:
            raise RunError(
                f"{self.out}: was deleted, moved or replaced while the run wrote into it (its lock, {LOCK}, is gone or "
                "another file); if it was moved, continue there: smarticles resume DIR; otherwise start the run anew"
            )
        if not (self.out / MANIFEST).is_file():
            raise RunError(
                f"{self.out / MANIFEST}: is gone, and without it the run cannot be read; put it back and continue with "
                "`smarticles resume`, or start the run anew"
            )


@contextmanager
def claimed(out: Path, *, resume: bool) -> Iterator[Claim]:
    """Lock a run directory while a run writes into it, and make it if needed.

    The operating system holds the lock and releases it with the end of the process, so that it is never stale.
    With `resume` the directory must hold a run, otherwise it must be new or empty. InputError if not, if it cannot be
    written, if another process writes into it, or if its file system has no locks.
    """
    _check_content(out, resume=resume)
    try:
        lock = (out / LOCK).open("a+")
    except OSError as error:
        msg = f"--out {out}: cannot be written ({error.strerror}); choose another directory, or allow it"
        raise InputError(msg) from None
    with lock:
        if not acquired(lock, f"--out {out}"):
            lock.seek(0)
            msg = f"--out {out}: process {lock.read().strip() or 'unknown'} is running it; wait for it or stop it"
            raise InputError(msg)
        # Checked again, since another process may have finished a run in the directory before the lock was free.
        _check_content(out, resume=resume)
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        yield Claim(out, lock)


def acquired(lock: TextIO, where: str) -> bool:
    """Lock an open file, and return whether that was possible: false if another process holds the lock.

    InputError, which begins with the place `where`, if the file system has no locks.
    """
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):  # the latter on network file systems
        return False
    except OSError as error:
        raise InputError(
            f"{where}: its file system cannot lock files ({error.strerror}), so that nothing would keep two processes "
            "from writing there at once; choose a directory on another file system, such as a local disk, or let the "
            "administrator mount this one with locks (Lustre: option flock; NFS: lock service)"
        ) from None
    return True


def _check_content(out: Path, *, resume: bool) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        held = sorted(path.name for path in out.iterdir() if path.name != LOCK and not is_partial(path.name))
    except OSError as error:
        raise InputError(f"--out {out}: cannot be made ({error.strerror}); choose another directory") from None
    problem = None
    if MANIFEST in held:
        if not resume:
            problem = "holds a run and is left as it is; go on with it by --resume, or choose another directory"
    elif held:
        what = f"no run to resume but files ({held[0]}, …)" if resume else f"files ({held[0]}, …)"
        problem = f"holds {what} and is left as it is; choose another directory"
    elif resume:
        problem = "holds no run to resume; leave --resume out to start one"
    if problem:
        raise InputError(f"--out {out}: {problem}")


def in_use(out: Path) -> bool:
    """Return whether a process holds the lock of a run directory."""
    try:
        with (out / LOCK).open() as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False  # no lock, or no permission to read it
    return False


class _LogFile(logging.FileHandler):
    """Log file that drops what a full disk cannot hold; `logging` would print a traceback for each line."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - of the base class
        if not isinstance(sys.exc_info()[1], OSError):
            super().handleError(record)


@contextmanager
def log_of(out: Path) -> Iterator[logging.Logger]:
    """Yield a logger that appends to `log.txt` of a run directory, and close it at the end."""
    log = logging.getLogger(f"smarticles.{out.resolve()}")
    log.setLevel(logging.INFO)
    log.propagate = False
    handler = _LogFile(out / LOG, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    try:
        yield log
    finally:
        log.removeHandler(handler)
        with suppress(OSError):  # lines that the disk could not hold
            handler.close()
