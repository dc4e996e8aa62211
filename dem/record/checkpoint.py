"""Checkpoints: all that a run needs to be resumed, in one checksummed file; the previous one is kept.

The engine's state is stored as bytes in the engine's own format, with the engine's name and version. The rest is plain
data. The running simulation reloads each checkpoint that it writes, since an engine may order bodies and contacts anew
when it loads.
"""

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

from dem.errors import InputError
from dem.record.files import cannot_write, reject_inflated, whole
from dem.record.names import CHECKPOINT, CHECKPOINT_BEFORE, CHECKPOINT_FORMAT

_ENGINE, _STATE, _SERIES = "engine.bin", "state.json", "series.npz"


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """Content of a checkpoint."""

    scene_sha256: str
    made_by: tuple[str, str]  #: Name and version of the engine
    state: Mapping[str, Any]  #: State of the run without engine and series, as plain data
    series: Mapping[str, NDArray[Any]]  #: Columns of the series so far
    engine: bytes  #: State of the engine


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint to the disk and keep the previous one; raise RunError if it cannot be written."""
    newest = folder / CHECKPOINT
    name, version = checkpoint.made_by
    head = {
        "format": CHECKPOINT_FORMAT,
        "made_by": {"engine": name, "version": version},
        "scene_sha256": checkpoint.scene_sha256,
    }
    columns = io.BytesIO()
    np.savez(columns, **checkpoint.series)  # type: ignore[arg-type] # the stubs take any keyword for allow_pickle
    try:
        with whole(newest, before=folder / CHECKPOINT_BEFORE) as temporary, temporary.open("wb") as file:
            with zipfile.ZipFile(file, "w") as archive:
                archive.writestr(_STATE, json.dumps({**head, **checkpoint.state}))
                archive.writestr(_SERIES, columns.getvalue())
                archive.writestr(_ENGINE, checkpoint.engine)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        cannot_write(newest, error, "and go on with `smarticles run … --resume`; the checkpoint before is whole")


def read_checkpoint(folder: Path, *, scene_sha256: str, made_by: tuple[str, str]) -> tuple[Checkpoint, str | None]:
    """Read the newest undamaged checkpoint of a run directory.

    The run's scene has the hash `scene_sha256`; `made_by` are name and version of the present engine. A warning is
    returned if the newest checkpoint is damaged and the previous one was read. InputError if there is no undamaged one,
    or it is of another format, engine or scene.
    """
    damaged: list[str] = []
    for name in (CHECKPOINT, CHECKPOINT_BEFORE):
        path = folder / name
        if not path.exists():
            continue
        try:
            format_, checkpoint = _read(path)
        # Damage can be anywhere in archive, JSON and arrays, and each reader fails in its own ways.
        except Exception as error:
            damaged.append(f"{name} ({' '.join(str(error).split())})")
            continue
        for what, found, wanted in (
            ("checkpoint format", format_, CHECKPOINT_FORMAT),
            ("engine", " ".join(checkpoint.made_by), " ".join(made_by)),
            ("scene", checkpoint.scene_sha256, scene_sha256),
        ):
            if found != wanted:
                msg = f"{path}: made with {what} {found}, here is {wanted}; resume with what made it, or start anew"
                raise InputError(msg)
        warning = f"damaged: {', '.join(damaged)}; going on from {name}" if damaged else None
        return checkpoint, warning
    cause = f"damaged: {', '.join(damaged)}" if damaged else "no checkpoint was written"
    raise InputError(f"{folder}: cannot be resumed, {cause}; start the run anew in another --out")


def has_checkpoint(folder: Path) -> bool:
    """Return whether a run directory holds a checkpoint, damaged or not."""
    return (folder / CHECKPOINT).exists() or (folder / CHECKPOINT_BEFORE).exists()


def _read(path: Path) -> tuple[object, Checkpoint]:
    """Return the number of the format of a checkpoint file, and the content."""
    with zipfile.ZipFile(path) as archive:
        reject_inflated(archive, path.stat().st_size)  # it is not compressed
        # Reading a member checks its CRC.
        state = json.loads(archive.read(_STATE))
        content = archive.read(_SERIES)
        with np.load(io.BytesIO(content)) as columns:
            reject_inflated(columns.zip, len(content))
            series = {name: columns[name] for name in columns.files}
        engine = archive.read(_ENGINE)
    scene, made_by = str(state.get("scene_sha256")), (str(state["made_by"]["engine"]), str(state["made_by"]["version"]))
    checkpoint = Checkpoint(scene_sha256=scene, made_by=made_by, state=state, series=series, engine=engine)
    return state.get("format"), checkpoint
