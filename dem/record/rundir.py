"""The run directory: claimed by one process at a time, with its log."""

from __future__ import annotations

import fcntl
import json
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
    try:
        out.mkdir(parents=True, exist_ok=True)
        held = sorted(path.name for path in out.iterdir() if path.name != LOCK and not is_partial(path.name))
    except OSError as error:
        msg = f"--out {out}: cannot be made ({error.strerror}); choose another directory"
        raise InputError(msg) from None
    if held and not resume:
        run = MANIFEST in held
        what, way_out = ("a run", "go on with it by --resume, or ") if run else (f"files ({held[0]}, …)", "")
        msg = f"--out {out}: holds {what} and is left as it is; {way_out}choose another directory"
        raise InputError(msg)
    if resume and MANIFEST not in held:
        msg = f"--out {out}: holds no run to resume; leave --resume out to start one"
        raise InputError(msg)
    with (out / LOCK).open("a+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.seek(0)
            msg = f"--out {out}: process {lock.read().strip() or 'unknown'} is running it; wait for it or stop it"
            raise InputError(msg) from None
        lock.truncate(0)
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        yield


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


def recorded_scene_hash(out: Path) -> str:
    """Hash of the scene that a run directory was made from.

    Raises:
        InputError: its manifest cannot be read.
    """
    path = out / MANIFEST
    try:
        return str(json.loads(path.read_text(encoding="utf-8"))["scene_sha256"])
    except (OSError, ValueError, KeyError, TypeError):
        msg = f"{path}: cannot be read; start the run anew in another --out"
        raise InputError(msg) from None


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
