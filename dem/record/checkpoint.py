"""Checkpoints: everything that a run needs to go on, in one checksummed file; the one before is kept.

A run on one thread that goes on from a checkpoint gives the same bits as the run that was never stopped, because the
running simulation reloads its own checkpoint whenever it writes one: YADE orders bodies and contacts anew when it
loads, and sums of forces depend on their order.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.errors import InputError, RunError

FORMAT = 4
CURRENT, PREVIOUS = "checkpoint.zip", "checkpoint.previous.zip"
_ENGINE, _STATE, _SERIES = "engine.yade", "state.json", "series.npz"


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """What a run needs to go on.

    Args:
        state: plain data: phase, stage, recorder, clock.
        series: columns of the series so far.
        engine: YADE's own serialisation.
    """

    state: Mapping[str, Any]
    series: Mapping[str, NDArray[Any]]
    engine: bytes


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write beside, flush to the disk, keep the one before, rename.

    Raises:
        RunError: it cannot be written; the checkpoints that were there stay.
    """
    temporary = folder / ".checkpoint.partial.zip"
    columns = io.BytesIO()
    np.savez(columns, **checkpoint.series)  # type: ignore[arg-type] # the stubs take any keyword for allow_pickle
    try:
        with temporary.open("wb") as file:
            with zipfile.ZipFile(file, "w") as archive:
                archive.writestr(_STATE, json.dumps({"format": FORMAT, **checkpoint.state}))
                archive.writestr(_SERIES, columns.getvalue())
                archive.writestr(_ENGINE, checkpoint.engine)
            file.flush()
            os.fsync(file.fileno())
        if (folder / CURRENT).exists():
            os.replace(folder / CURRENT, folder / PREVIOUS)  # noqa: PTH105 - the atomic call by its name
        os.replace(temporary, folder / CURRENT)  # noqa: PTH105
    except OSError as error:
        temporary.unlink(missing_ok=True)
        msg = (
            f"{folder / CURRENT}: cannot be written ({error.strerror or error}); free space and go on with "
            "`smarticles run … --resume`; the checkpoint before is whole"
        )
        raise RunError(msg) from error


def read_checkpoint(folder: Path, *, scene_sha256: str, yade: str) -> tuple[Checkpoint, str | None]:
    """The newest checkpoint that is whole.

    Args:
        folder: the run directory.
        scene_sha256: of the scene that is to go on.
        yade: version of the YADE that runs.

    Returns:
        The checkpoint, and a warning where the newest one was damaged and the one before is used.

    Raises:
        InputError: no whole checkpoint, or one of another format, YADE or scene.
    """
    damaged: list[str] = []
    for name in (CURRENT, PREVIOUS):
        path = folder / name
        if not path.exists():
            continue
        try:
            checkpoint = _read(path)
        except (zipfile.BadZipFile, KeyError, ValueError, OSError, EOFError) as error:
            damaged.append(f"{name} ({' '.join(str(error).split())})")
            continue
        _check(path, checkpoint.state, scene_sha256=scene_sha256, yade=yade)
        warning = f"damaged: {', '.join(damaged)}; going on from {name}" if damaged else None
        return checkpoint, warning
    cause = f"damaged: {', '.join(damaged)}" if damaged else "no checkpoint was written"
    msg = f"{folder}: cannot be resumed, {cause}; start the run anew in another --out"
    raise InputError(msg)


def has_checkpoint(folder: Path) -> bool:
    """Whether a run directory holds a checkpoint, whole or not."""
    return (folder / CURRENT).exists() or (folder / PREVIOUS).exists()


def _read(path: Path) -> Checkpoint:
    with zipfile.ZipFile(path) as archive:
        # Reading a member checks its CRC.
        state = json.loads(archive.read(_STATE))
        with np.load(io.BytesIO(archive.read(_SERIES))) as columns:
            series = {name: columns[name] for name in columns.files}
        return Checkpoint(state=state, series=series, engine=archive.read(_ENGINE))


def _check(path: Path, state: Mapping[str, Any], *, scene_sha256: str, yade: str) -> None:
    for what, found, wanted in (
        ("checkpoint format", state.get("format"), FORMAT),
        ("YADE", state.get("yade"), yade),
        ("scene", state.get("scene_sha256"), scene_sha256),
    ):
        if found != wanted:
            msg = f"{path}: made with {what} {found}, here is {wanted}; resume with what made it, or start anew"
            raise InputError(msg)
