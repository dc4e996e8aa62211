"""Import YADE from the packages of the Linux distribution; no other module imports `yade`."""

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem.arrays import Array
from dem.errors import RunError


@dataclass(frozen=True)
class Yade:
    """The parts of YADE that this project uses."""

    classes: Any
    utils: Any
    omega: Any  #: YADE's simulation, one per process
    vector: Any  #: Constructor of a vector from three numbers
    quaternion: Any  #: Constructor of a unit quaternion from (w, x, y, z)


def rows_of(vectors: Iterable[Any]) -> Array:
    """Return the components (n, 3) of n vectors of YADE, five times faster than NumPy's conversion."""
    return np.array([(v[0], v[1], v[2]) for v in vectors], dtype=np.float64).reshape(-1, 3)


def load_yade() -> Yade:
    """Return YADE with an empty simulation."""
    import_yade()
    from yade import utils, wrapper  # noqa: PLC0415 - YADE is imported when an engine is built, not before
    from yade.minieigenHP import Quaternion, Vector3  # noqa: PLC0415

    omega = wrapper.Omega()
    omega.reset()
    return Yade(wrapper, utils, omega, Vector3, Quaternion)


def yade_version() -> str:
    """Return the version of the installed YADE."""
    import_yade()
    return str(importlib.import_module("yade.config").version)


def yade_threads() -> int:
    """Return the number of threads of YADE in this process: OMP_NUM_THREADS, by default 1."""
    import_yade()
    from yade import wrapper  # noqa: PLC0415

    return int(wrapper.Omega().numThreads)


def import_yade() -> Any:
    """Return the module `yade` of the Linux distribution; raise RunError if it is not installed."""
    # Threads that find no free core spin; a run of seconds would take minutes.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    for folder in Path("/usr/lib").glob("*/yade*/py"):
        if folder.parent.name in ("yade", "yade-double") and str(folder) not in sys.path:
            sys.path.append(str(folder))
    try:
        # YADE prints a greeting to standard output, where only the output of the command belongs.
        with contextlib.redirect_stdout(io.StringIO()):
            return importlib.import_module("yade")
    except ImportError as error:
        raise RunError(
            f"YADE cannot be imported ({error}), the engine of scenes without the key engine; install it with "
            "`make setup` or `apt-get install yade`, see environment.md, or write `engine: links` into the scene, "
            "which needs no YADE (--engine links); `smarticles doctor` reports what is missing"
        ) from None
