"""The study of the chain: runs with a known force, strain and width, and its findings on trials made to order."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic.strained import WIDTH, write_strained_run

from postprocess.measures.strain import AT_PEAK, FRACTURE, PEAK, STIFFNESS
from postprocess.statistics.points import marked
from studies.chain import CONFINEMENT, COUNT, STUDY, VARIANT

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study chain --out chain"}


def write_pull(directory: Path, *, variant: str, ratio: float, stiffness: float, **run: Any) -> Path:
    """A chain whose force rises by `stiffness` [N] times the strain, to 0.4, and is gone."""
    made: dict[str, Any] = {"channel": WIDTH / ratio, "name": variant, "frames_per_phase": 1, **run}
    return write_strained_run(directory, lambda strains: np.where(strains <= 0.4, stiffness * strains, 0.0), **made)


def test_means_over_trials_and_changes_are_those_put_in(tmp_path: Path) -> None:
    """Two and six robots, six a tenth stiffer; friction adds a fifth; seeds scatter by 1 %."""
    runs = []
    for seed, factor in ((1, 0.99), (2, 1.01)):
        for count, ratio in ((2, 0.52), (2, 0.65), (6, 0.52), (6, 0.65)):
            place: dict[str, Any] = {"count": count, "ratio": ratio, "seed": seed, "variant": "baseline"}
            stiffness = factor * (3.3 if count == 6 else 3.0)
            runs.append(write_pull(tmp_path / f"b{count}_{ratio}_{seed}", stiffness=stiffness, **place))
        rubbed: dict[str, Any] = {"count": 2, "ratio": 0.65, "seed": seed, "variant": "friction"}
        runs.append(write_pull(tmp_path / f"f_{seed}", stiffness=1.2 * factor * 3.0, **rubbed))
    report = STUDY.analyse([*runs, tmp_path / "absent"], tmp_path / "out", **ORIGIN)
    point = report.tables["points"].set_index([VARIANT, COUNT, CONFINEMENT]).loc[("baseline", 2, 0.52)]
    assert (point["seeds [-]"], point["yielded [-]"]) == (2, 0)
    assert point[PEAK] == pytest.approx(1.2, rel=1e-3)
    assert point[STIFFNESS] == pytest.approx(3.0, rel=1e-3)
    assert point[marked(STIFFNESS, "95 %")] == pytest.approx(0.03 * 12.7062, rel=1e-3)
    assert point[FRACTURE] == pytest.approx(0.4)
    cells = dict(zip(report.header, report.rows[0], strict=True))
    assert (cells["mm/s"], cells["peak force [N]"], cells["strain at the yield drop"]) == ("20", "1.200 ± 0.012", "-")
    changes = report.tables["sensitivity"].set_index("quantity")["change [%]"]
    assert changes.to_dict() == pytest.approx({PEAK: 20, FRACTURE: 0, AT_PEAK: 0, STIFFNESS: 20}, abs=0.01)
    assert {f"{figure.name}.png" for figure in STUDY.figures} <= set(report.files)
    assert report.missing[0].directory.endswith("absent")
