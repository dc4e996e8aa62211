"""Commented scenes to begin with, one file per kind; `smarticles init` writes them."""

from __future__ import annotations

from pathlib import Path

from dem.errors import InputError, nearest

KINDS = ("shaken", "actuated", "hook", "melting", "casting", "collapse", "chain")
"""In the order of the help; the first one is the default."""


def starter(kind: str) -> str:
    """Return the text of a scene."""
    if kind not in KINDS:
        raise InputError(f"{kind!r} is no kind of scene; {nearest(kind, KINDS)}")
    return Path(__file__).with_name(f"{kind}.yaml").read_text(encoding="utf-8")


def about(kind: str) -> str:
    """Return what a scene does, in one line."""
    return starter(kind).partition("\n")[0].removeprefix("# ")
