"""Runs that are averaged must be alike."""

from __future__ import annotations

from pathlib import Path

import pytest
from synthetic import SyntheticRun, write_manifest

from dem.errors import InputError
from dem.record.manifest import read_run
from studies.framework.runs import Collected, MeasuredRun


def collected(folder: Path, *runs: SyntheticRun) -> Collected:
    measured = []
    for number, run in enumerate(runs):
        directory = folder / "abcd"[number]
        directory.mkdir(exist_ok=True)
        write_manifest(directory, run)
        measured.append(MeasuredRun(manifest=read_run(directory), rows=[{}]))
    return Collected(study="melting", given=(), runs=tuple(measured), missing=())


def test_only_runs_of_one_group_must_be_alike(tmp_path: Path) -> None:
    runs = [
        SyntheticRun(aspect_ratio=0.4, count=12, seed=1),
        SyntheticRun(aspect_ratio=0.7, count=9, seed=1),
        SyntheticRun(aspect_ratio=0.7 + 1e-9, count=9, seed=2),
    ]
    made = collected(tmp_path, *runs)
    made.refuse_mixed_counts()
    with pytest.raises(InputError, match=r"count must not be averaged: .*a is 12 smarticles, .*b is 9"):
        made.refuse_other_counts()
    mixed = collected(tmp_path, *runs, SyntheticRun(aspect_ratio=0.7, count=10, seed=3))
    with pytest.raises(InputError, match=r"b is 9 smarticles at l/w 0.7, .*d is 10 smarticles at l/w 0.7; analyse"):
        mixed.refuse_mixed_counts()
