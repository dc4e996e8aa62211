"""Each finding on samples that have it, that have the opposite, and that have nothing but scatter."""

import math

import numpy as np
import pandas as pd
import pytest

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import findings_table
from studies.base.activity import ENERGY, HALF, HEIGHT, LOWEST, PHI_ACTIVE, QUANTITIES, SAMPLED, STRAIGHT
from studies.base.procedures import CROSSINGS, EXTERNAL, INTERNAL, PHI, PROCEDURE, SHAPE, STATIC, THETA
from studies.procedures.findings import findings

ASPECTS = (0.4, 0.55, 0.7, 0.8, 0.9, 1.0)
AMPLITUDES = {0.4: (5, 10, 15), 0.5: (5, 10, 15, 20), 0.7: (5, 10, 15, 20, 30), 1.0: (5, 10, 15, 20, 30)}
LEVELS = {  # φ and ⟨N⟩ of each procedure at l/w = 0.7, and how ⟨N⟩ goes with l/w
    STATIC: (0.12, 1.0, 0.0),
    EXTERNAL: (0.14, 1.3, 0.5),
    SHAPE: (0.11, 2.0, 1.0),
    INTERNAL: (0.16, 1.5, 0.5),
}
SCATTER = {
    PHI: 0.0005, PHI_ACTIVE: 0.0005, CROSSINGS: 0.03, ENERGY: 1e-7, SAMPLED: 1e-7, HEIGHT: 0.002, STRAIGHT: 0.002,
    LOWEST: 0.002, HALF: 0.01,
}  # fmt: skip
MOVED_BY_MOTORS = (SHAPE, INTERNAL)


def blank(seeds=(1, 2, 3)):
    """Rows of the full study without values."""
    rows = []
    for seed in seeds:
        for procedure in LEVELS:
            for aspect in ASPECTS if procedure != STATIC else (*ASPECTS, 0.5):
                thetas = AMPLITUDES.get(aspect, (10,)) if procedure == INTERNAL else (math.nan,)
                rows += [(procedure, aspect, float(theta), seed) for theta in thetas]
        rows += [(INTERNAL, 0.5, float(theta), seed) for theta in AMPLITUDES[0.5]]
    return pd.DataFrame(rows, columns=[PROCEDURE, ASPECT, THETA, SEED]).reindex(
        columns=[PROCEDURE, ASPECT, THETA, SEED, *QUANTITIES]
    )


def as_in_the_paper(seeds=(1, 2, 3), *, scatter=1.0, random=0):
    """Samples with all findings of the paper."""
    table = blank(seeds)
    generator = np.random.default_rng(random)
    for index, row in table.iterrows():
        procedure, aspect, theta = row[PROCEDURE], row[ASPECT], row[THETA]
        phi, crossings, rise = LEVELS[procedure]
        table.loc[index, PHI] = phi - 0.05 * (aspect - 0.7) + 0.05 * (aspect - 0.7) ** 2
        table.loc[index, CROSSINGS] = crossings + rise * (aspect - 0.7)
        if procedure == INTERNAL:
            table.loc[index, PHI] += 0.02 * (aspect - 0.7) - 0.0015 * (theta - 10)
            peak = -0.02 * (theta - 10) if aspect < 0.51 else -0.004 * (theta - 12) ** 2 + 0.016
            table.loc[index, CROSSINGS] += peak
            table.loc[index, ENERGY] = 1e-6 * theta / 10 * (0.5 + aspect) + (5e-7 if aspect == 0.9 else 0.0)
            table.loc[index, [HEIGHT, HALF]] = [0.8, 0.12]
        elif procedure == SHAPE:
            table.loc[index, ENERGY] = 1e-4 * (0.5 + aspect) + (5e-5 if aspect == 0.9 else 0.0)
            table.loc[index, [HEIGHT, STRAIGHT, LOWEST]] = [1.1, 1.3, 1.05]
        elif procedure == EXTERNAL:
            table.loc[index, ENERGY] = 1.4e-6 * (0.5 + aspect)
            table.loc[index, HEIGHT] = 0.9
        table.loc[index, SAMPLED] = table.loc[index, ENERGY] if procedure in MOVED_BY_MOTORS else math.nan
    table[PHI_ACTIVE] = table[PHI]
    for quantity, size in SCATTER.items():
        table[quantity] += scatter * size * generator.standard_normal(len(table))
    return table


def nothing(random, *, seeds=(1, 2, 3)):
    """Samples of procedures that do nothing at all: scatter about the same state; piles differ by seed and l/w."""
    table = blank(seeds)
    generator = np.random.default_rng(random)
    level = {PHI: 0.12, PHI_ACTIVE: 0.12, CROSSINGS: 1.0, ENERGY: 1e-5, SAMPLED: 0.0, HEIGHT: 1.0, STRAIGHT: 1.0}
    level |= {LOWEST: 1.0, HALF: 0.5}
    piles = {key: generator.standard_normal() for key, _ in table.groupby([ASPECT, SEED])}
    for quantity, size in SCATTER.items():
        pile = [3 * piles[key] for key in zip(table[ASPECT], table[SEED], strict=True)]
        shared = np.array(pile) if quantity in (PHI, PHI_ACTIVE, CROSSINGS) else 0.0
        table[quantity] = level[quantity] + size * (shared + generator.standard_normal(len(table)))
    table.loc[table[PROCEDURE] == STATIC, [ENERGY, HEIGHT]] = math.nan
    table.loc[~table[PROCEDURE].isin(MOVED_BY_MOTORS), SAMPLED] = math.nan
    table.loc[table[PROCEDURE] != SHAPE, [STRAIGHT, LOWEST]] = math.nan
    table.loc[table[PROCEDURE] != INTERNAL, HALF] = math.nan
    return table


def verdicts(table):
    """Verdicts by the paper's findings."""
    return {finding.paper: finding.verdict for finding in findings(table)}


def row_of(table, start):
    """The finding that is called so, or the only one that begins so."""
    told = findings(table)
    (found,) = [one for one in told if one.paper == start] or [one for one in told if one.paper.startswith(start)]
    return found


FLAT = "⟨N⟩ of static hardly depends on l/w"
RATIO = "Shape change costs more than 10 times the energy of internal oscillation"
PEAK = "Internal oscillation: the energy has a local maximum at l/w = 0.9"
PEAK_BY_SAMPLES = f"{PEAK}, summed every 0.1 s"
SIMILAR = "External and internal oscillation need similar energies, internal slightly less"


def test_all_findings_of_the_paper_are_found_where_they_are():
    found = verdicts(as_in_the_paper())
    assert len(found) == 36
    assert set(found.values()) == {"found"}, found


def test_numbers_are_those_put_in():
    table = as_in_the_paper(scatter=0.0)
    rises = row_of(table, "Shape change: the centre of mass rises").ours
    assert rises.startswith("h/h0 − 1 while straight +0.3 ± ")
    assert "(n = 18); h/h0 by l/w 0.4: 1.300, 0.55: 1.300" in rises
    densest = row_of(table, "Internal oscillation packs densest").ours
    # 0.04, 0.02 and 0.05 at l/w = 0.7, and 0.02 more per l/w; its mean is 0.693 where static is, 0.725 of the others.
    assert "less static +0.0399 ±" in densest
    assert "less external +0.0205 ±" in densest
    assert "less shape-change +0.0505 ±" in densest
    assert "above at 7 of 7 l/w; less external" in densest
    assert densest.count("above at 6 of 6 l/w") == 2
    assert "φ_f against θ -0.0015 ±" in row_of(table, "Internal oscillation: lower θ").ours
    costs = row_of(table, RATIO).ours
    assert costs.startswith("ratio 100 ×/÷ 1 (n = 18,")
    assert "0.4: 100, 0.55: 100" in costs
    assert "by l/w 0.4: 9e-07, 0.5: 1e-06" in row_of(table, "Internal oscillation: energy grows with l/w").ours
    assert "reached after 0.12 ±" in row_of(table, "Internal oscillation: half").ours
    assert "nothing beyond 1 was run" in row_of(table, "⟨N⟩ of external").ours
    peak = row_of(table, "Internal oscillation: ⟨N⟩ peaks").ours
    # Parabola about 12°: at 10° and 15° mean −0.026 of it, at 5° −0.196, at 20° and 30° −0.776.
    assert "less that at 5° +0.17 ±" in peak
    assert "less that at 20° to 30° +0.75 ±" in peak


def test_nothing_is_found_where_nothing_is():
    """Beyond one in forty, each of the claims that something differs."""
    draws = [verdicts(nothing(random)) for random in range(40)]
    claims = [paper for paper in draws[0] if paper not in (FLAT, SIMILAR)]
    found = sum(draw[claim] == "found" for draw in draws for claim in claims)
    assert found / (len(draws) * len(claims)) < 0.04
    for claim in claims:
        assert sum(draw[claim] == "found" for draw in draws) <= 5, claim
    # The one claim that something does not differ is true here; the scatter leaves it open in some draws.
    flat = [draw[FLAT] for draw in draws]
    assert flat.count("found") > 15
    assert flat.count("not found") <= 2


def internal(table):
    return table[PROCEDURE] == INTERNAL


def only(table, procedure):
    return table[PROCEDURE] == procedure


def put(quantity, procedure, value):
    """Sets a quantity of a procedure, a number or a function of the table, and keeps the scatter."""

    def change(table):
        rows = only(table, procedure)
        scatter = SCATTER[quantity] * np.random.default_rng(12).standard_normal(int(rows.sum()))
        table.loc[rows, quantity] = (value(table[rows]) if callable(value) else value) + scatter

    return change


def falling(part, level, slope):
    """φ against l/w, bent as in the paper."""
    return level - slope * (part[ASPECT] - 0.7) + 0.05 * (part[ASPECT] - 0.7) ** 2


OPPOSITES = {
    "φ_0 of the poured": put(PHI, STATIC, lambda part: part[ASPECT]),
    "External oscillation: φ_f falls": put(PHI_ACTIVE, EXTERNAL, lambda part: part[ASPECT]),
    "External oscillation: φ changes": put(PHI_ACTIVE, EXTERNAL, lambda part: 1 - (part[ASPECT] - 0.7) ** 2),
    "External oscillation makes": put(PHI_ACTIVE, EXTERNAL, 0.05),
    "Shape change: the pile sinks at first": put(LOWEST, SHAPE, 1.4),
    "Shape change: after that drop": put(LOWEST, SHAPE, 1.4),
    "Shape change: φ_f falls": put(PHI_ACTIVE, SHAPE, lambda part: part[ASPECT]),
    "Internal oscillation: the pile becomes lower": put(HEIGHT, INTERNAL, 1.1),
    "Internal oscillation: φ_f falls": put(PHI_ACTIVE, INTERNAL, lambda part: part[ASPECT]),
    "Internal oscillation: Δφ": put(PHI_ACTIVE, INTERNAL, lambda part: 0.2 - 0.15 * part[ASPECT]),
    "Internal oscillation: the largest": put(PHI_ACTIVE, INTERNAL, 0.2),
    "Shape change needs the most": put(ENERGY, EXTERNAL, 1e-3),
    "Internal oscillation needs the least": put(ENERGY, EXTERNAL, 1e-8),
    "Shape change costs more than 10 times the energy of internal oscillation, summed": put(SAMPLED, SHAPE, 2e-6),
    "Internal oscillation: energy grows with θ, s": put(SAMPLED, INTERNAL, lambda part: 5e-6 - 1e-7 * part[THETA]),
    "Internal oscillation: energy grows with l/w, s": put(SAMPLED, INTERNAL, lambda part: 5e-6 - 3e-6 * part[ASPECT]),
    PEAK: put(ENERGY, INTERNAL, lambda part: (part[ASPECT] - 0.9) ** 2 * 1e-4),
    PEAK_BY_SAMPLES: put(SAMPLED, INTERNAL, lambda part: (part[ASPECT] - 0.9) ** 2 * 1e-4),
    "External and internal": put(ENERGY, EXTERNAL, 1e-7),
    "Shape change: the centre of mass rises": put(STRAIGHT, SHAPE, 0.9),
    "Shape change: the centre of mass does not": put(HEIGHT, SHAPE, 0.9),
    "Internal oscillation packs densest": put(PHI_ACTIVE, EXTERNAL, 0.2),
    "Of the three activities": put(PHI_ACTIVE, SHAPE, 0.15),
    "Internal oscillation: half": put(HALF, INTERNAL, 0.5),
    "Internal oscillation: lower θ": put(PHI_ACTIVE, INTERNAL, lambda part: 0.15 + 0.001 * part[THETA]),
    RATIO: put(ENERGY, SHAPE, 5e-6),
    "Internal oscillation: energy grows with θ": put(ENERGY, INTERNAL, lambda part: 5e-6 - 1e-7 * part[THETA]),
    "Internal oscillation: energy grows with l/w": put(ENERGY, INTERNAL, lambda part: 5e-6 - 3e-6 * part[ASPECT]),
    "⟨N⟩ is lowest for static": put(CROSSINGS, STATIC, 3.0),
    FLAT: put(CROSSINGS, STATIC, lambda part: 0.2 + part[ASPECT]),
    "⟨N⟩ is highest for shape change": put(CROSSINGS, SHAPE, 0.5),
    "⟨N⟩ of shape change rises": put(CROSSINGS, SHAPE, lambda part: 3 - part[ASPECT]),
    "⟨N⟩ of external": put(CROSSINGS, EXTERNAL, lambda part: 2 - part[ASPECT]),
    "⟨N⟩ of internal": put(CROSSINGS, INTERNAL, lambda part: 2 - (part[ASPECT] - 0.7) ** 2 * 10),
    "Internal oscillation: ⟨N⟩ falls": put(CROSSINGS, INTERNAL, lambda part: 1 + 0.02 * part[THETA]),
    "Internal oscillation: ⟨N⟩ peaks": put(CROSSINGS, INTERNAL, lambda part: 2 - 0.02 * part[THETA]),
}


@pytest.mark.parametrize("start", OPPOSITES)
def test_the_opposite_is_not_found(start):
    table = as_in_the_paper()
    OPPOSITES[start](table)
    assert row_of(table, start).verdict == "not found"


def test_what_only_leans_towards_a_maximum_is_none():
    """Above the mean of its neighbours, yet below one of them: the top of a bump that stands beside it."""
    table = as_in_the_paper()
    put(ENERGY, INTERNAL, lambda part: 1e-5 * (part[ASPECT] > 0.85) + 2e-5 * part[ASPECT])(table)
    found = row_of(table, PEAK)
    assert found.verdict == "not found"
    assert "there less at 0.8 +1.2" in found.ours
    assert "; less at 1 -" in found.ours


INDIFFERENT = {
    "Shape change: the centre of mass rises": put(STRAIGHT, SHAPE, 1.0),
    "Shape change: the centre of mass does not": put(HEIGHT, SHAPE, 1.0),
    "Internal oscillation packs densest": put(PHI_ACTIVE, EXTERNAL, lambda part: falling(part, 0.16, 0.03)),
    "Of the three activities": put(PHI_ACTIVE, SHAPE, lambda part: falling(part, 0.14, 0.05)),
    "Internal oscillation: half": put(HEIGHT, INTERNAL, 1.0),
    "Internal oscillation: lower θ": put(PHI_ACTIVE, INTERNAL, 0.15),
    RATIO: put(ENERGY, SHAPE, lambda part: 1e-5 * (0.5 + part[ASPECT])),
    "Internal oscillation: energy grows with θ": put(ENERGY, INTERNAL, 1e-6),
    "Internal oscillation: energy grows with l/w": put(ENERGY, INTERNAL, 1e-6),
    "⟨N⟩ is lowest for static": put(CROSSINGS, STATIC, lambda part: 1.3 + 0.5 * (part[ASPECT] - 0.7)),
    "⟨N⟩ is highest for shape change": put(CROSSINGS, SHAPE, lambda part: 1.5 + 0.5 * (part[ASPECT] - 0.7)),
    "⟨N⟩ of shape change rises": put(CROSSINGS, SHAPE, 2.0),
    "⟨N⟩ of external": put(CROSSINGS, EXTERNAL, 1.3),
    "Internal oscillation: ⟨N⟩ falls": put(CROSSINGS, INTERNAL, 1.5),
    "Internal oscillation: ⟨N⟩ peaks": put(CROSSINGS, INTERNAL, 1.5),
}


@pytest.mark.parametrize("start", INDIFFERENT)
def test_no_difference_is_not_resolved(start):
    table = as_in_the_paper()
    INDIFFERENT[start](table)
    assert row_of(table, start).verdict == "not resolved"


def test_wide_scatter_resolves_nothing():
    wide = verdicts(as_in_the_paper(scatter=200.0))
    assert "found" not in {wide[paper] for paper in wide if paper.startswith("Internal oscillation: lower")}
    assert list(wide.values()).count("found") <= 8


def test_a_peak_beyond_one_is_seen_where_it_was_run():
    table = as_in_the_paper()
    beyond = table[(table[PROCEDURE] == EXTERNAL) & (table[ASPECT] == 1.0)].assign(**{ASPECT: 1.1})
    lower = pd.concat([table, beyond.assign(**{CROSSINGS: beyond[CROSSINGS] - 0.5})], ignore_index=True)
    higher = pd.concat([table, beyond.assign(**{CROSSINGS: beyond[CROSSINGS] + 0.5})], ignore_index=True)
    assert row_of(lower, "⟨N⟩ of external").verdict == "found"
    assert "nothing beyond" not in row_of(lower, "⟨N⟩ of external").ours
    assert row_of(higher, "⟨N⟩ of external").verdict == "not found"


@pytest.mark.parametrize(
    ("top", "verdict"), [(1.0, "found"), (0.76, "not found"), (1.3, "not found"), (0.85, "not resolved")]
)
def test_a_flat_top_is_placed_by_all_runs(top, verdict):
    """No mean is clearly above that at l/w = 1.0; where the parabola through all of them is highest is clear."""
    table = as_in_the_paper(range(8))
    where = table[PROCEDURE] == EXTERNAL
    beyond = table[where & (table[ASPECT] == 1.0)].assign(**{ASPECT: 1.1})
    table = pd.concat([table, beyond], ignore_index=True)
    own = table[PROCEDURE] == EXTERNAL
    scatter = 0.1 * np.random.default_rng(4).standard_normal(own.sum())
    table.loc[own, CROSSINGS] = 6.2 - 5 * (table.loc[own, ASPECT] - top) ** 2 + scatter
    assert row_of(table, "⟨N⟩ of external").verdict == verdict


def test_one_seed_can_resolve_what_holds_at_every_aspect_ratio():
    table = as_in_the_paper((1,))
    table = table[table[ASPECT].isin([0.4, 0.7, 1.0]) & ~table[THETA].isin([5, 15, 20])]
    found = verdicts(table)
    assert found["Shape change: the centre of mass rises when the smarticles straighten"] == "found"
    assert found["Internal oscillation packs densest"] == "found"
    # One amplitude at l/w = 0.4, two beyond.
    assert row_of(table, "Internal oscillation: ⟨N⟩ falls").verdict == "no data"
    assert row_of(table, "Internal oscillation: ⟨N⟩ peaks").verdict == "no data"


@pytest.mark.parametrize("kept", [[STATIC], [STATIC, EXTERNAL], []])
def test_procedures_that_were_not_run_give_no_data(kept):
    table = as_in_the_paper()
    found = verdicts(table[table[PROCEDURE].isin(kept)])
    assert found[RATIO] == "no data"
    assert found["Internal oscillation packs densest"] == "no data"
    assert (found[FLAT] == "found") == (STATIC in kept)


def test_energy_that_is_not_positive_gives_no_ratio():
    table = as_in_the_paper()
    table.loc[internal(table), ENERGY] = -1e-6
    assert row_of(table, RATIO).verdict == "no data"


def test_table_tells_all_of_a_finding():
    found = findings(as_in_the_paper())
    table = findings_table(found)
    assert list(table.columns) == ["finding in the paper", "ours", "verdict", "criterion", "needed"]
    assert table["verdict"].tolist() == [finding.verdict for finding in found]
    assert (table.drop(columns="needed").map(len) > 0).all(axis=None)
