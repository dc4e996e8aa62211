"""The figure of one energy by two readings."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import pandas as pd

from postprocess.report import figures
from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from studies.base.activity import ENERGY, SAMPLED
from studies.base.procedures import AMPLITUDE, INTERNAL, PROCEDURE, SHAPE, THETA
from studies.procedures.energy_readings import draw_readings

LABELS = {SHAPE: "shape change", INTERNAL: "internal oscillation"}
FOOTER = ["Study procedures: 32 runs.", "More: findings.md."]


def means(*, sampled: float) -> pd.DataFrame:
    """Means of two procedures at four l/w; by samples a share of the integral."""
    rows = [
        {
            PROCEDURE: name,
            THETA: AMPLITUDE if name == INTERNAL else math.nan,
            ASPECT: aspect,
            ENERGY: energy,
            SAMPLED: sampled * energy,
            marked(ENERGY, "95 %"): 0.1 * energy,
            marked(SAMPLED, "95 %"): 0.1 * sampled * energy,
        }
        for name, energy in ((SHAPE, 5e-5), (INTERNAL, 2e-4))
        for aspect in (0.4, 0.7, 0.9, 1.1)
    ]
    return pd.DataFrame(rows)


def drawn(folder: Path, points: pd.DataFrame) -> list[Path]:
    with figures.style():
        return draw_readings(folder / "energy_readings", points, LABELS, FOOTER)


def test_two_panels_of_one_scale_tell_which_is_which(tmp_path: Path) -> None:
    files = {path.suffix: path for path in drawn(tmp_path, means(sampled=0.1))}
    assert set(files) == {".png", ".svg", ".pdf"}
    text = " ".join(" ".join(ElementTree.parse(files[".svg"]).getroot().itertext()).split())
    for words in ("integrated over every step", "summed over samples 0.1 s apart", "energy per smarticle [µJ]"):
        assert words in text
    assert "where the paper's energies have a local maximum" in text
    assert "Error bars: 95 %" in text
    # 200 µJ are on the axis that both panels share.
    assert "200" in text
    # By samples it is 20 µJ at most, which a scale of its own would name.
    assert text.split().count("200") == 1
    assert "20" not in text.split()


def test_without_samples_there_is_no_such_figure(tmp_path: Path) -> None:
    assert drawn(tmp_path, means(sampled=math.nan)) == []
    assert list(tmp_path.iterdir()) == []
