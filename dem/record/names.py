"""The files of a run directory and the formats of those that have one; docs/reference/files.md says what is in them."""

from __future__ import annotations

SCENE = "scene.yaml"
MANIFEST = "run.json"
OF_SWEEP = "sweep.json"  # the manifest of a sweep, which holds run directories; written by `templates.sweep`
DONE = "done.json"
FAILED = "failed.json"
PROGRESS = "progress.json"
LOG = "log.txt"
LOCK = ".lock"
SERIES = "series.h5"
CHECKPOINT = "checkpoint.zip"
CHECKPOINT_BEFORE = "checkpoint.previous.zip"

# Nouns of the VTK files of centrelines, of spheres and of forces at contacts; see `collection` and `member`.
FRAME, SPHERE, FORCE = "frame", "sphere", "force"

SERIES_FORMAT = 1
CHECKPOINT_FORMAT = 4


def folder(noun: str) -> str:
    """Return the folder of the files of a noun, `frames` of "frame"."""
    return f"{noun}s"


def collection(noun: str) -> str:
    """Return the name of the list of all files of a noun with their times."""
    return f"{noun}s.pvd"


def member(noun: str, number: int) -> str:
    """Return the name of one file of a noun, by its number from 0."""
    return f"{noun}s/{noun}_{number:06d}.vtu"


def partial(name: str) -> str:
    """Return the name of a file while it is written."""
    stem, dot, suffix = name.rpartition(".")
    return f".{stem}.partial{dot}{suffix}" if stem else f".{name}.partial"


def is_partial(name: str) -> bool:
    """Return whether a file is one that a killed process had not finished writing."""
    return name.startswith(".") and ".partial." in name
