# mypy: allow-untyped-calls
"""Keep compiled code for later processes, and let other processes wait while one process compiles.

Numba's own cache is beside the source, which may be read-only. It does not notice changes of a function in another file
that a kernel calls, executes damaged files, and lets all processes of a sweep compile at once. This cache is a folder
of the user, whose name is a hash of everything that the code depends on, so that another version of the package never
loads the code. A file's name states the types of arguments, and the fields that are None, for which the code was
compiled. A checksum rejects damaged files. If the cache cannot be used, a run compiles without it.
"""

import hashlib
import logging
import math
import os
import pickle
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from inspect import signature
from itertools import chain
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.registry import cpu_target
from numba.core.serialize import dumps

from dem.physics import motor

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOG = logging.getLogger(__name__)
FOLDER = "SMARTICLES_CACHE_DIR"  # environment variable: where compiled code is kept, instead of the user's cache folder
LONGEST = "advance"  # kernel that takes most of the time to compile; others take about a second
PATIENCE = 600.0  # s; a process that has waited for another one so long compiles by itself
CHECK_INTERVAL = 0.1  # s
_ANNOUNCED = threading.Event()
DIGEST = hashlib.sha256().digest_size  # bytes


@cache
def stamp() -> str:
    """Return a hash of the sources and of the versions of Numba and NumPy, on which results depend."""
    digest = hashlib.sha256()
    for path in (*sorted(Path(__file__).parent.rglob("*.py")), Path(motor.__file__)):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    digest.update(repr((numba.__version__, np.__version__)).encode())
    return digest.hexdigest()[:16]


def _folders() -> Iterator[Path]:
    """Yield the folders in which compiled code may be kept, the best one first."""
    if given := os.environ.get(FOLDER):
        yield Path(given)
        return
    home = os.environ.get("XDG_CACHE_HOME")
    yield (Path(home) if home else Path.home() / ".cache") / "smarticles"
    yield Path(tempfile.gettempdir()) / f"smarticles-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"


@cache
def folder() -> Path | None:
    """Return the folder of code for this processor, made if needed; None, and a warning, if that fails."""
    causes = []
    machine = repr((sys.implementation.cache_tag, cpu_target.target_context.codegen().magic_tuple()))
    for base in _folders():
        path = base / f"links-{stamp()}-{hashlib.sha256(machine.encode()).hexdigest()[:8]}"
        try:
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Compiled code is executed: in a folder that all can write to, another user could have left some.
            if hasattr(os, "getuid") and path.stat().st_uid != os.getuid():
                causes.append(f"{path} (belongs to another user)")
                continue
            with tempfile.TemporaryFile(dir=path):
                return path
        except (OSError, RuntimeError) as error:
            causes.append(f"{path} ({getattr(error, 'strerror', None) or error})")
    LOG.warning(
        "compiled code cannot be kept in %s; every run compiles; set %s to a writable folder",
        " or ".join(causes),
        FOLDER,
    )
    return None


def is_kept(without: frozenset[str]) -> bool:
    """Return whether the cache has the code for simulations that lack some groups of arrays.

    These are arguments of kernels, or fields of them, that are None in these simulations, such as "hooks" or "motors".
    """
    where = folder()
    return where is not None and any(where.glob(f"{_title(LONGEST, without)}.*.code"))


def _title(kernel: str, without: frozenset[str]) -> str:
    return "-".join([kernel, *(["without", *sorted(without)] if without else [])])


def _lacking(kind: Any, name: str) -> Iterator[str]:
    """Yield the names of all fields of a kernel's argument that are None, including fields of fields.

    `kind` is Numba's type of the argument, `name` its name, which is yielded if the argument itself is None.
    """
    if isinstance(kind, types.NoneType):
        yield name
    elif isinstance(kind, types.NamedTuple | types.NamedUniTuple):
        for field, of_field in zip(kind.fields, kind.types, strict=True):
            yield from _lacking(of_field, field)


class KernelCache(NullCache):
    """Compiled code of one kernel, a file for each signature; Numba's dispatcher calls the methods.

    A file holds the SHA-256 of its name and content, then the content, as Numba pickles it.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._kernel = function.__name__
        self._arguments = tuple(signature(function).parameters)
        self._enabled = True

    def path(self, types_: Any) -> Path | None:
        """Return the file for some types of the arguments; None if the cache has no folder."""
        where = folder() if self._enabled else None
        named = zip(types_, self._arguments, strict=True)
        lacking = frozenset(chain.from_iterable(_lacking(kind, name) for kind, name in named))
        digest = hashlib.sha256(str(types_).encode()).hexdigest()[:16]
        return None if where is None else where / f"{_title(self._kernel, lacking)}.{digest}.code"

    @contextmanager
    def turn(self, types_: Any) -> Iterator[None]:
        """Return a context manager in which this process compiles while others that need the code wait."""
        path = self.path(types_)
        if path is None or path.exists():
            yield
        else:
            with _locked(path.with_suffix(".lock")):
                yield

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code for a signature; None if there is none, or it is damaged."""
        path = self.path(sig)
        found = None if path is None else self._read(path, target_context)
        if found is None and self._kernel == LONGEST:
            announce()
        return found

    def _read(self, path: Path, target_context: Any) -> Any:
        try:
            # An overload refers to functions of the context, which are registered now.
            target_context.refresh()
            content = path.read_bytes()
            if content[:DIGEST] != _digest(path, content[DIGEST:]):
                raise ValueError("its checksum is wrong")
            return CompileResult._rebuild(target_context, *pickle.loads(content[DIGEST:]))
        except FileNotFoundError:
            return None
        except Exception as error:
            LOG.warning("%s: compiled code cannot be read (%s); compiling anew", path, _cause(error))
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write compiled code into the cache; log a warning if that fails."""
        path = self.path(sig)
        if path is None or data.library.has_dynamic_globals:
            return
        temporary = path.with_suffix(f".{os.getpid()}.tmp")
        try:
            content = dumps(data._reduce())
            temporary.write_bytes(_digest(path, content) + content)
            temporary.replace(path)
        except Exception as error:
            self._enabled = False
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            LOG.warning("%s: compiled code cannot be written (%s); the next run compiles again", path, _cause(error))


def _digest(path: Path, content: bytes) -> bytes:
    return hashlib.sha256(path.name.encode() + b"\0" + content).digest()


def _cause(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Return a context manager that waits for the lock of a file and holds it until the block ends.

    If another process holds the lock for longer than `PATIENCE`, or locks do not work here, the block runs without it.
    """
    file = None
    try:
        if fcntl is not None:
            with suppress(OSError):
                file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
                _wait_for(file)
        yield
    finally:
        if file is not None:
            os.close(file)


def _wait_for(file: int) -> None:
    """Wait for the lock of an open file, at most for `PATIENCE`; then go on without it.

    OSError if the file system has no locks.
    """
    begun = time.monotonic()
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            _announce_wait()
            if time.monotonic() - begun > PATIENCE:
                LOG.warning("another process has compiled for %g s; compiling here as well", PATIENCE)
                return
            time.sleep(CHECK_INTERVAL)


def announce(seconds: float = math.nan) -> None:
    """Log that this process compiles the engine; only the first call in a process has an effect.

    The message states the expected processor time `seconds`; NaN: unknown.
    """
    if not _ANNOUNCED.is_set():
        _ANNOUNCED.set()
        about = "" if math.isnan(seconds) else f", about {seconds:.0f} s of processor time"
        kept = "" if folder() is None else "; later runs find the code"
        LOG.warning("compiling the links engine%s%s", about, kept)


@cache
def _announce_wait() -> None:
    LOG.warning("another process compiles the links engine; waiting for its code")
