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

FRAME = "frame"
"""Noun of the pictures of centrelines; see `collection` and `member`."""
SPHERE = "sphere"
"""Noun of the pictures of spheres."""
FORCE = "force"
"""Noun of the pictures of forces at contacts."""

SERIES_FORMAT = 1
CHECKPOINT_FORMAT = 4


def folder(noun: str) -> str:
    """Where files of a noun lie: `frames` of "frame".

    Example:
        >>> folder(FRAME), collection(FRAME), member(FRAME, 7)
        ('frames', 'frames.pvd', 'frames/frame_000007.vtu')
    """
    return f"{noun}s"


def collection(noun: str) -> str:
    """The list of all files of a noun with their times."""
    return f"{noun}s.pvd"


def member(noun: str, number: int) -> str:
    """One file of a noun, by its number from 0."""
    return f"{noun}s/{noun}_{number:06d}.vtu"


def partial(name: str) -> str:
    """What a file is called while it is written."""
    stem, dot, suffix = name.rpartition(".")
    return f".{stem}.partial{dot}{suffix}" if stem else f".{name}.partial"


def is_partial(name: str) -> bool:
    """Whether a file is one that a killed process had not finished writing."""
    return name.startswith(".") and ".partial." in name
