"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dem.errors import RunError
from dem.record.names import partial


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` make a file under a temporary name beside `path`, then rename it.

    Args:
        path: the file that is to appear, or to be replaced; its folder is made if needed.
        write: called with the temporary path, which keeps the suffix of `path`.

    Raises:
        RunError: the disk is full or the folder cannot be written; what was at `path` before is untouched.
    """
    temporary = path.with_name(partial(path.name))
    try:
        path.parent.mkdir(exist_ok=True)
        write(temporary)
        os.replace(temporary, path)  # noqa: PTH105 - the atomic call by its name
    except OSError as error:
        _remove(temporary)
        msg = (
            f"{path}: cannot be written ({error.strerror or error}); free space or choose another --out; "
            "everything written before is whole"
        )
        raise RunError(msg) from error
    except BaseException:
        _remove(temporary)
        raise


def _remove(path: Path) -> None:
    # Where even this fails, the first error is the one to tell.
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write text whole."""

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")

    write_whole(path, write)


def write_json(path: Path, data: Any) -> None:
    """Write JSON whole."""
    write_text(path, json.dumps(data, indent=2, ensure_ascii=False) + "\n")
