"""Commented example scenes, one file per kind, which `smarticles init` writes."""

from pathlib import Path

from dem.errors import InputError, nearest

KINDS = ("shaken", "actuated", "hook", "melting", "casting", "collapse", "chain")
"""Kinds in the order of the help; the first is the default."""


def starter(kind: str) -> str:
    """Return the YAML text of the example scene of a kind; raise InputError for an unknown kind."""
    if kind not in KINDS:
        raise InputError(f"{kind!r} is no kind of scene; {nearest(kind, KINDS)}")
    return path_of(kind).read_text(encoding="utf-8")


def path_of(kind: str) -> Path:
    """Return the file of the example scene of a kind."""
    return Path(__file__).with_name(f"{kind}.yaml")


def about(kind: str) -> str:
    """Return a description of the example scene of a kind in one line."""
    return starter(kind).partition("\n")[0].removeprefix("# ")
