"""What a directory is, and so what its page tells."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from dem.errors import InputError
from dem.record.names import MANIFEST as RUN
from smarticles.reporting.page import Page
from smarticles.reporting.results import PROVENANCE, results_page
from smarticles.reporting.run import run_page
from smarticles.reporting.sweep import sweep_page
from templates.local.runner import slots_here
from templates.sweep.folder import MANIFEST as SWEEP
from templates.sweep.folder import open_folder


def page_of(directory: Path, *, table: Path | None = None, jobs: int | None = None) -> Page:
    """The page of a run, a sweep, a study, or the results of a study.

    Args:
        directory: what it is of.
        table: measured errors of fidelities; None: those that ship.
        jobs: runs that are measured at once; None: one per core.

    Raises:
        InputError: the directory is none of these, or a file of it is damaged.
    """
    try:
        made = f"smarticles {version('smarticles')}"
    except PackageNotFoundError:
        made = "smarticles"
    if (directory / SWEEP).is_file():
        return sweep_page(open_folder(directory), table, made, jobs=jobs or slots_here())
    if (directory / RUN).is_file():
        return run_page(directory, table, made)
    if (directory / PROVENANCE).is_file():
        return results_page(directory, made)
    msg = f"{directory}: is no run, sweep or study, nor the results of one; give what `smarticles run` or `sweep` made"
    raise InputError(msg)
