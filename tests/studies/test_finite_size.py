"""The study of finite size: what is measured of a pile, and answers to laws and thresholds that were put in."""

from pathlib import Path
from typing import Any

import pytest
from synthetic import SyntheticRun, write_run
from synthetic.shapes import RADIUS, W

from dem.record.run import Run, open_run
from postprocess.measures.table import summarise_run
from studies.finite_size import AFTER, BEFORE, MOVING, crossings, measure, phi, share, spans
from studies.finite_size import RADIUS as RADIUS_OVER_W


def write(folder: Path, *, ratio: float = 0.7, count: int = 12, seed: int = 1, **more: Any) -> Path:
    run = SyntheticRun(aspect_ratio=ratio, count=count, seed=seed, packing=(0.10, 0.11, 0.15, 0.14), **more)
    return write_run(folder / f"lw{ratio:.2f}_n{count}_seed{seed}", run)


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    directory = write(tmp_path, count=60, frames_per_phase=40)
    row: dict[str, Any] = dict(measure(open_run(directory)))  # type: ignore[arg-type]
    # The last frame of a phase is 0.2 % beside its φ, to one side or the other.
    assert row[phi(BEFORE)] == pytest.approx(0.11, rel=0.003)
    assert row[phi(AFTER)] == pytest.approx(0.14, rel=0.003)
    assert row[MOVING] == pytest.approx(0.15, rel=0.003)
    assert row[RADIUS_OVER_W] == pytest.approx(RADIUS / W)
    assert row["escaped at the end [-]"] == 0
    every = summarise_run(Run(directory), last=1, definitions=["voxel"], phases={1, 3}).set_index("phase")
    for stage, phase in ((BEFORE, 1), (AFTER, 3)):
        there = every.loc[phase]
        assert row[crossings(stage)] == there["crossings mean [-]"] > 0
        assert row[share(stage)] == there["crossing graph largest share [-]"] > 1 / 60
        assert row[spans(stage, "height")] == there["crossing graph spans height [-]"]
        assert row[spans(stage)] == min(row[spans(stage, what)] for what in ("height", "width"))
        assert row[phi(stage, "voxel")] == there["phi voxel [-]"]
