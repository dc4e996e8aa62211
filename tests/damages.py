"""Damages to files of run directories, drawn at random."""

import json
import os
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

WRONG: list[Any] = [None, True, -1, 10**30, 1e300, "x", "\x1b[2J", [], [1], {}, {"a": 1}]


def deleted(path: Path, _: random.Random) -> None:
    path.unlink()


def truncated(path: Path, rng: random.Random) -> None:
    os.truncate(path, rng.randrange(path.stat().st_size))


def flipped(path: Path, rng: random.Random) -> None:
    content = bytearray(path.read_bytes())
    for _ in range(rng.choice([1, 1, 10])):
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    path.write_bytes(content)


def zeroed(path: Path, rng: random.Random) -> None:
    content = bytearray(path.read_bytes())
    begin = rng.randrange(len(content))
    end = rng.randrange(begin, len(content)) + 1
    content[begin:end] = bytes(end - begin)
    path.write_bytes(content)


def as_folder(path: Path, _: random.Random) -> None:
    path.unlink()
    path.mkdir()


def mistyped(path: Path, rng: random.Random) -> None:
    """Replace a value in JSON, or in the JSON of a checkpoint, whose checksum then fits again."""
    if path.suffix == ".zip":
        with zipfile.ZipFile(path) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        parts["state.json"] = json.dumps(misfit(json.loads(parts["state.json"]), rng)).encode()
        with zipfile.ZipFile(path, "w") as archive:
            for name, part in parts.items():
                archive.writestr(name, part)
    elif path.suffix == ".json":
        path.write_text(json.dumps(misfit(json.loads(path.read_text()), rng)))
    else:
        path.write_text("schema_version: [")


def misfit(data: Any, rng: random.Random) -> Any:
    if isinstance(data, dict | list) and data and rng.random() < 0.8:
        key = rng.choice(list(data)) if isinstance(data, dict) else rng.randrange(len(data))
        data[key] = misfit(data[key], rng)
        return data
    return rng.choice(WRONG)


DAMAGES: list[Callable[[Path, random.Random], None]] = [deleted, truncated, flipped, zeroed, as_folder, mistyped]
