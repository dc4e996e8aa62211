"""Keep tables of measures in run directories, to be read again until files or program change."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import RunError
from dem.record.files import write_text
from dem.record.names import DONE, FAILED, FORCE, FRAME, MANIFEST, SCENE, SERIES, VTKHDF, collection, folder

if TYPE_CHECKING:
    import pandas as pd

_READ = (SCENE, MANIFEST, DONE, FAILED, SERIES, VTKHDF, collection(FRAME), collection(FORCE))

_PIECE = 2**20  # bytes


def key_of(directory: Path) -> str:
    """Return a hash of all files that measures of a run read, and of the program that measures."""
    content = hashlib.sha256(_program().encode())
    members = (path for noun in (FRAME, FORCE) for path in sorted((directory / folder(noun)).glob("*.vtu")))
    for path in (*(directory / name for name in _READ), *members):
        if path.is_file():
            content.update(f"\n{path.name} {path.stat().st_size}\n".encode())
            # In pieces: one file may hold all frames.
            with path.open("rb") as file:
                while piece := file.read(_PIECE):
                    content.update(piece)
    return content.hexdigest()


def read_kept(directory: Path, kind: str, key: str) -> pd.DataFrame | None:
    """Read the table that `keep` stored in a run directory with this kind and key; None if there is none.

    None is also returned for a damaged file. Parameters are those of `keep`.
    """
    import pandas as pd  # noqa: PLC0415

    try:
        own, digest, text = _file(directory, kind).read_text(encoding="utf-8").split("\n", 2)
    except (OSError, ValueError):
        return None
    if (own, digest) != (key, hashlib.sha256(text.encode()).hexdigest()):
        return None
    content = json.loads(text)
    # The directory may have been moved, or be named by another path.
    return pd.DataFrame(content["rows"], columns=content["columns"]).assign(run=str(directory))


def keep(table: pd.DataFrame, directory: Path, kind: str, key: str) -> None:
    """Store a table of measures in a run directory; do nothing if the file cannot be written.

    `kind` is what the table contains, such as `phases-phase-end`; `key` is a hash from `key_of`.
    """
    rows = table.astype(object).to_numpy().tolist()
    text = json.dumps({"columns": list(table.columns), "rows": rows}, default=_plain)
    content = f"{key}\n{hashlib.sha256(text.encode()).hexdigest()}\n{text}"
    # In a read-only directory or on a full disk the table is computed again next time.
    with suppress(RunError):
        write_text(_file(directory, kind), content, make_folder=False)


def _file(directory: Path, kind: str) -> Path:
    return directory / f".measures-{kind}.txt"


def _plain(value: Any) -> Any:
    return value.item()  # a number of NumPy


@cache
def _program() -> str:
    """Return a hash of the source code of all measures and readers, and of the versions of the libraries."""
    import numpy as np  # noqa: PLC0415
    import pandas as pd  # noqa: PLC0415
    import scipy  # noqa: PLC0415

    content = hashlib.sha256(f"{sys.version} {np.__version__} {scipy.__version__} {pd.__version__}".encode())
    for path in _sources():
        content.update(path.read_bytes())
    return content.hexdigest()


def _sources() -> Iterator[Path]:
    import dem  # noqa: PLC0415
    import postprocess  # noqa: PLC0415
    from postprocess.measures.registry import registered  # noqa: PLC0415

    for package in (dem, postprocess):
        yield from sorted(Path(str(package.__file__)).parent.rglob("*.py"))
    # Measures of other packages.
    functions = [getattr(measure, "function", measure.take) for measure in registered()]
    takes = [getattr(function, "func", function) for function in functions]
    modules = {take.__module__ for take in takes if not take.__module__.startswith("postprocess.")}
    yield from (Path(str(sys.modules[name].__file__)) for name in sorted(modules))
