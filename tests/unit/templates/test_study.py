"""The shipped studies: they expand, and say how the quick variant differs."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

import templates
from dem.errors import InputError
from dem.parts import Deposit, Relax, Shake
from templates.expand import Point, expand
from templates.study import differences, study_file, study_names
from templates.sweep import load_sweep

STUDIES = Path(templates.__file__).parent / "studies"


def points(*, quick: bool) -> list[Point]:
    return expand(load_sweep(study_file("gravish", quick=quick)))


def test_the_full_study_is_the_papers() -> None:
    with (STUDIES / "savoie_counts.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    found = points(quick=False)
    assert [(p.scene.smarticle.aspect_ratio, p.scene.count, p.scene.seed) for p in found] == [
        (float(row["l_over_w"]), int(row["n"]), seed) for row in rows for seed in (1, 2, 3)
    ]
    assert len(found) == 24
    assert found[9].name == "lw0.70_seed1"
    for point, row in zip(found[::3], rows, strict=True):
        deposit, rest, shake, again = point.scene.phases
        assert isinstance(deposit, Deposit)
        assert deposit.per_layer == int(row["per_layer"])
        assert isinstance(shake, Shake)
        assert (shake.duration_s, shake.frequency_hz, shake.peak_acceleration_g) == (5.0, 30, 2)
        assert isinstance(rest, Relax)
        assert isinstance(again, Relax)
        assert rest.duration_s == again.duration_s == 0.5


def test_the_counts_are_those_of_the_reference() -> None:
    """The layers of the source times the number per layer are its counts."""
    with (STUDIES / "savoie_counts.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            assert int(row["layers"]) * int(row["per_layer"]) == int(row["n"])


def test_the_quick_variant_has_the_three_aspect_ratios_and_seeds() -> None:
    found = points(quick=True)
    assert {p.scene.smarticle.aspect_ratio for p in found} == {0.4, 0.7, 1.0}
    assert {p.scene.seed for p in found} == {1, 2, 3}


def test_the_quick_variant_says_how_it_differs() -> None:
    lines = differences(points(quick=True), points(quick=False))
    assert lines[0] == "9 runs instead of 24"
    assert "l_over_w: only 0.4, 0.7, 1.0 of 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1" in lines
    assert any(line.startswith("shake_s: ") and line.endswith(" instead of 5.0") for line in lines)
    # Columns that follow from l/w, and what is the same, are not told.
    assert not any(line.startswith(("n:", "layers:", "seed:", "relax_s:")) for line in lines)


def test_nothing_differs_from_itself() -> None:
    assert differences(points(quick=False), points(quick=False)) == []


def test_an_unknown_study_is_an_input_error() -> None:
    assert "gravish" in study_names()
    with pytest.raises(InputError, match=r"'gravitsh' does not exist; did you mean 'gravish'\?"):
        study_file("gravitsh")


def test_every_data_file_of_a_study_is_named_in_its_readme() -> None:
    readme = (STUDIES / "README.md").read_text(encoding="utf-8")
    for path in STUDIES.glob("*.csv"):
        assert path.name in readme
