"""The study of engines: runs whose packing is made up, equal, 8 % apart, or scattered."""

import math
from pathlib import Path

import pytest
from synthetic import SyntheticRun, write_manifest, write_run

from studies.engines import STUDY
from studies.framework.findings import within
from studies.framework.study import Report

SEEDS = (1, 2, 3, 4)


def write(folder: Path, variant: str, seed: int, factor: float, case: str) -> Path:
    """A run whose φ is that of its seed times a factor."""
    level = factor * (1 + 0.004 * (-1) ** seed)
    kind = {"external": "shake", "internal": "internal-oscillation"}[case]
    made = SyntheticRun(
        name=f"{case}/{variant}",
        seed=seed,
        packing=(0.10 * level, 0.10 * level, 0.13 * level, 0.14 * level),
        phases=("deposit", "relax", kind, "relax"),
        frames_per_phase=2,
        work=1e-4,
        shake_time=5.0,
    )
    directory = write_run(folder / f"{case}_{variant}_seed{seed}", made)
    write_manifest(directory, made, engine="links" if variant == "links" else "yade")
    return directory


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """Shaken alike but for 8 % in φ, oscillated alike; a finer pitch in between."""
    root = tmp_path_factory.mktemp("engines")
    runs = [
        write(root, variant, seed, factor, case)
        for seed in SEEDS
        for case, variant, factor in (
            ("external", "links", 1.08),
            ("external", "yade", 1.0),
            ("external", "pitch-0.5", 1.04),
            ("internal", "links", 1.001),
            ("internal", "yade", 1.0),
        )
    ]
    given = [*runs, root / "chain_links_seed1"]
    return STUDY.analyse(given, root / "out", note="a test", command="smarticles study engines")


def test_what_agrees_is_equivalent_and_what_does_not_is_different(report: Report) -> None:
    table = report.tables["equivalence"].set_index("quantity")
    assert table.loc["φ_f at rest, internal", "verdict"] == "equivalent"
    one = table.loc["φ_f at rest, external"]
    assert (one["verdict"], one["pairs [-]"]) == ("different", len(SEEDS))
    assert one["difference [%]"] == pytest.approx(8.0, abs=0.1)
    # Pairs share their seed's scatter, which is wider between them.
    assert one["difference 95 % [%]"] < 0.2 < one["difference 95 % unpaired [%]"]
    # A seed counts once however many of its runs begin alike: the mean of 8 and 0.1.
    assert table.loc["φ_0", "pairs [-]"] == len(SEEDS)
    assert table.loc["φ_0", "difference [%]"] == pytest.approx(4.05, abs=0.1)
    verdicts = {one.finding.id: str(one.verdict) for one in report.judged}
    assert (verdicts["φ_f-at-rest-external"], verdicts["φ_f-at-rest-internal"]) == ("not found", "found")
    assert verdicts["chain-force"] == "no data"
    assert report.missing[0].status == "not started"


def test_chains_are_followed_to_links(report: Report) -> None:
    table = report.tables["pitch"]
    rows = table[table["quantity"] == "φ_f at rest, external"].set_index("pitch [-]")
    assert rows.index.tolist() == [0.0, 0.5, 1.0]
    assert rows["less links [%]"].tolist()[1:] == pytest.approx([-3.7, -7.4], abs=0.1)
    assert math.isnan(rows["less links [%]"].iloc[0])
    assert {"differences.png", "pitch.png"} <= set(report.files)


@pytest.mark.parametrize(
    ("percent", "half_width", "verdict"),
    [
        (0.0, 4.9, "found"),
        (4.0, 0.9, "found"),
        (4.0, 1.1, "not resolved"),
        (0.0, 5.1, "not resolved"),  # not significant, and no proof of anything
        (-6.0, 1.1, "not resolved"),
        (-6.0, 0.9, "not found"),
        (1.0, math.nan, "not resolved"),
        (math.nan, math.nan, "no data"),
    ],
)
def test_a_number_within_a_margin(percent: float, half_width: float, verdict: str) -> None:
    assert within(percent, half_width, 5.0) == verdict
