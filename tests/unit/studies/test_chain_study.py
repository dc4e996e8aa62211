"""The study of the chain, from run directories with a known force, strain and width."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic.strained import WIDTH, write_strained_run

from dem.errors import InputError
from postprocess.measures.strain import FRACTURE, PEAK, STIFFNESS
from postprocess.statistics.findings import CRITERION, Finding
from postprocess.statistics.points import marked
from studies.base.report import Report
from studies.chain import figures as chain_figures
from studies.chain import measure as chain_measure
from studies.chain.measure import CONFINEMENT, COUNT, VARIANT
from studies.chain.study import Chain
from studies.framework.provenance import SAVOIE

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study chain --out chain"}


def write_pull(directory: Path, *, variant: str, ratio: float, stiffness: float, **run: Any) -> Path:
    """A chain whose force rises by `stiffness` [N] times the strain, to 0.4, and is gone."""
    made: dict[str, Any] = {"channel": WIDTH / ratio, "name": variant, "frames_per_phase": 1, **run}
    return write_strained_run(directory, lambda strains: np.where(strains <= 0.4, stiffness * strains, 0.0), **made)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two and six robots, six a tenth stiffer; friction adds a fifth; seeds scatter by 1 %."""
    root, made = tmp_path_factory.mktemp("chain"), []
    for seed, factor in ((1, 0.99), (2, 1.01)):
        for count, ratio in ((2, 0.52), (2, 0.65), (6, 0.52), (6, 0.65)):
            stiffness = factor * (3.3 if count == 6 else 3.0)
            place: dict[str, Any] = {"count": count, "ratio": ratio, "seed": seed}
            made.append(write_pull(root / f"b{count}_{ratio}_{seed}", variant="baseline", stiffness=stiffness, **place))
        rubbed: dict[str, Any] = {"count": 2, "ratio": 0.65, "seed": seed, "stiffness": 1.2 * factor * 3.0}
        made.append(write_pull(root / f"f_{seed}", variant="friction", **rubbed))
    return made


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Sequence[str]]:
    """Leaves out the figures, and keeps what would stand below them."""
    footers: list[Sequence[str]] = []

    def draw(*_: object, footer: Sequence[str], **__: object) -> list[Path]:
        footers.append(footer)
        return []

    monkeypatch.setattr(chain_figures, "draw", draw)
    return footers


def report(runs: Sequence[Path], output: Path) -> Report[Finding]:
    return Chain().analyse([*runs, output / "absent"], output, **ORIGIN)


def test_means_over_trials_are_those_put_in(runs: list[Path], tmp_path: Path, drawn: list[Sequence[str]]) -> None:
    found = report(runs, tmp_path / "out")
    table = pd.read_csv(found.files["points.csv"], comment="#").set_index([VARIANT, COUNT, CONFINEMENT])
    point = table.loc[("baseline", 2, 0.52)]
    assert (point["seeds [-]"], point["yielded [-]"]) == (2, 0)
    assert point[PEAK] == pytest.approx(1.2, rel=1e-3)
    assert point[STIFFNESS] == pytest.approx(3.0, rel=1e-3)
    assert point[marked(STIFFNESS, "SE")] == pytest.approx(0.03, rel=1e-3)
    assert point[marked(STIFFNESS, "95 %")] == pytest.approx(0.03 * 12.7062, rel=1e-3)
    assert point[FRACTURE] == pytest.approx(0.4)
    assert found.header[:5] == ["variant", "n", "h/H", "mm/s", "trials"]
    cells = dict(zip(found.header, found.rows[0], strict=True))
    assert cells == {
        "variant": "baseline",
        "n": "2",
        "h/H": "0.52",
        "mm/s": "20",
        "trials": "2",
        "peak force [N]": "1.200 ± 0.012",
        "strain at the peak": "0.400 ± 0.000",
        "strain at fracture": "0.400 ± 0.000",
        "strain at the yield drop": "-",
        "stiffness [N]": "3.00 ± 0.03",
        "widening": "0.040 ± 0.000",  # a tenth of the strain
        "wall force [N]": "0.00 ± 0.00",
    }
    assert len(drawn) == 1


def test_texts_say_what_was_found_and_of_what(runs: list[Path], tmp_path: Path, drawn: list[Sequence[str]]) -> None:
    found = report(runs, tmp_path / "out")
    text = found.files["findings.md"].read_text()
    assert "| friction | +20.0 ± 0.0 | +0.0 ± 0.0 | +20.0 ± 0.0 |" in text
    assert text.count("| found if |") == 1
    parts = [text.index(part) for part in ("## Points", "## What the assumptions matter", "columns of `points.csv`")]
    assert parts == sorted(parts)
    assert (
        "10 of 11 runs, 1 missing; 2 trials per point; 20 mm/s: baseline n = 2, baseline n = 6, friction n = 2." in text
    )
    assert f"Reference: {SAVOIE.statement}.  " in text
    assert CRITERION in text
    # Figures are short: which runs, and where the rest is.
    assert drawn[0] == (
        "Study chain, fidelity draft: 10 of 11 runs, 1 missing; 2 trials per point.",
        "Planned: the full study as shipped. Commit 0e4b151. More: findings.md, provenance.json.",
    )
    assert "absent" in found.files["missing.csv"].read_text()


def test_a_study_without_a_packing_fraction_defines_none(
    runs: list[Path], tmp_path: Path, drawn: list[Sequence[str]]
) -> None:
    content = json.loads(report(runs, tmp_path / "out").files["provenance.json"].read_text())
    assert content["reference"]["doi"] == "10.1039/d2sm01573k"
    assert not {"definition", "definition_meaning", "frames_averaged_at_most"} & set(content)
    assert drawn


def test_a_trial_given_twice_is_refused(runs: list[Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"point = baseline n 2 h/H 0.52 with seed 1 is given twice"):
        Chain().analyse([runs[0], runs[0]], tmp_path / "out", **ORIGIN)


def test_of_bodies_confinement_tells_where_walls_are(tmp_path: Path, drawn: list[Sequence[str]]) -> None:
    places = []
    for seed, ratio in ((1, 0.52), (1, 0.65), (2, 0.52), (2, 0.65)):
        place = tmp_path / f"{ratio}_{seed}"
        places.append(write_pull(place, variant="baseline", ratio=ratio, stiffness=3.0, count=2, seed=seed))
        content = json.loads((place / "run.json").read_text())
        # A chain that is wider at the start than the paper's, between the paper's walls.
        content |= {"middle_thickness_in_plane_m": 0.021, "channel_width_m": 0.8 * content["channel_width_m"]}
        (place / "run.json").write_text(json.dumps(content))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chain_measure, "PAPER_WIDTH", 0.8 * WIDTH)
        found = Chain("chain-bodies").analyse(places, tmp_path / "out", **ORIGIN)
    table = pd.read_csv(found.files["points.csv"], comment="#")
    assert table[CONFINEMENT].tolist() == [0.52, 0.65]
    told = (tmp_path / "out" / "findings.md").read_text()
    assert "Bodies are 21 mm thick in the plane." in told
    assert f"the chain is {1e3 * WIDTH:.1f} mm wide at the start" in told
