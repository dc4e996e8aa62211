"""Compile kernels, and keep compiled code in a cache.

Numba's own cache is beside the source, which may be read-only, and it does not notice changes of a function in another
file that a kernel calls. This cache is a folder of the user, whose name is a hash of everything that the code depends
on, so that another version of the package never loads the code. If the cache cannot be used, a run compiles without it.
"""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, _CacheLocator
from numba.core.caching import FunctionCache as NumbaCache

from dem.physics import motor

F = TypeVar("F", bound=Callable[..., Any])

LOG = logging.getLogger(__name__)
FOLDER = "SMARTICLES_CACHE_DIR"  # environment variable: where compiled code is kept, instead of the user's cache folder

# Without reordered arithmetic: with `fastmath`, a process that compiles and one that loads compiled code differ in
# their last bits. A division by zero gives inf, as in NumPy, and costs no branch. Without reference counts nothing can
# be allocated in a kernel, and passing arrays around costs nothing.
OPTIONS: dict[str, Any] = {"fastmath": False, "error_model": "numpy", "_nrt": False}
# Parts are called by kernels alone. What Python needs to call a function takes 40 % of the time of compiling it.
NOT_FROM_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def part(function: F) -> F:
    """Compile a function that only kernels call; a call from Python crashes the process."""
    return numba.njit(**OPTIONS, **NOT_FROM_PYTHON)(function)  # type: ignore[no-any-return]


def inlined(function: F) -> F:
    """Compile a small function into the functions that call it.

    An array counts as about ten arguments of a call, and `Bodies` alone has twelve arrays, so that a call would cost
    more than most small functions.
    """
    return numba.njit(forceinline=True, **OPTIONS, **NOT_FROM_PYTHON)(function)  # type: ignore[no-any-return]


def kernel(function: F) -> F:
    """Compile a function at its first call from Python, and keep the code for later processes."""
    compiled = numba.njit(**OPTIONS)(function)
    compiled._cache = _Cache(compiled.py_func)
    return compiled  # type: ignore[no-any-return]


@cache
def stamp() -> str:
    """Return the hash of all that compiled code depends on: sources, options, versions of Numba and NumPy."""
    digest = hashlib.sha256()
    for path in (*sorted(Path(__file__).parent.rglob("*.py")), Path(motor.__file__)):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    digest.update(repr((sorted((OPTIONS | NOT_FROM_PYTHON).items()), numba.__version__, np.__version__)).encode())
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
    """Return the folder of compiled code, made if needed; log a warning and return None if that fails."""
    causes = []
    for base in _folders():
        path = base / f"links-{stamp()}"
        try:
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Compiled code is loaded as it is: in a folder that all can write to, another could have left some.
            if hasattr(os, "getuid") and path.stat().st_uid != os.getuid():
                causes.append(f"{path} (belongs to another user)")
                continue
            with tempfile.TemporaryFile(dir=path):
                return path
        except (OSError, RuntimeError) as error:
            causes.append(f"{path} ({getattr(error, 'strerror', None) or error})")
    LOG.warning(
        "compiled code cannot be kept in %s; every run compiles for about 15 s; set %s to a writable folder",
        " or ".join(causes),
        FOLDER,
    )
    return None


@cache
def _announce() -> None:
    where = folder()
    kept = "" if where is None else f", kept in {where}"
    LOG.warning("compiling the links engine, about 15 s, and 10 s for each further kind of phase%s", kept)


class _Locator(_CacheLocator):
    """Names of folder and files for Numba's cache."""

    def __init__(self, line: int) -> None:
        self._line = line

    def get_cache_path(self) -> str:
        return str(folder())

    def get_source_stamp(self) -> str:
        return stamp()

    def get_disambiguator(self) -> str:
        return str(self._line)

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> _Locator:
        return cls(py_func.__code__.co_firstlineno)


class _Implementation(CompileResultCacheImpl):
    _locator_classes = [_Locator]  # type: ignore[list-item] # noqa: RUF012 - the type that Numba gives it


class _Cache(NumbaCache):
    """Numba's cache in `folder`; if the cache fails, code is compiled and a warning is logged."""

    _impl_class = _Implementation

    def __init__(self, function: Any) -> None:
        self._function = function
        self._ready = False
        self._enabled = True

    def _prepare(self) -> bool:
        # At the first call, not at import: that must not touch the disk.
        if not self._ready and self._enabled:
            if folder() is None:
                self._enabled = False
            else:
                super().__init__(self._function)  # type: ignore[no-untyped-call]
                self._ready = True
        return self._ready and self._enabled

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled code for a signature; None if there is none, or it cannot be read."""
        found = None
        try:
            if self._prepare():
                found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception as error:
            self._give_up("read", error)
        if found is None:
            _announce()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write compiled code into the cache; log a warning if that fails."""
        try:
            if self._prepare():
                super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except Exception as error:
            self._give_up("written", error)

    def _give_up(self, done: str, error: Exception) -> None:
        self._enabled = False
        LOG.warning(
            "%s: compiled code cannot be %s (%s); compiling instead; remove the folder to have it made anew",
            folder(),
            done,
            " ".join(str(error).split()) or type(error).__name__,
        )
