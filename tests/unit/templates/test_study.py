"""The shipped studies: they expand, and say how the quick variant differs."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import templates
from dem.errors import InputError
from dem.parts import FIDELITIES, Deposit, Fidelity, Relax, Shake
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
    assert not any(line.startswith(("n:", "layers:", "seed:", "title:")) for line in lines)


def test_nothing_differs_from_itself() -> None:
    assert differences(points(quick=False), points(quick=False)) == []


def test_an_unknown_study_is_an_input_error() -> None:
    assert "gravish" in study_names()
    with pytest.raises(InputError, match=r"'gravitsh' does not exist; did you mean 'gravish'\?"):
        study_file("gravitsh")


def test_a_study_without_a_quick_variant_says_so() -> None:
    with pytest.raises(InputError, match="study sensitivity has no quick variant; leave --quick out"):
        study_file("sensitivity", quick=True)


@pytest.mark.parametrize(
    ("study", "choices"),
    [
        ("sensitivity", {"draft": 0, "diameter-1.27mm": 1, "friction-0.6": 2}),  # friction of smarticles and of walls
        ("sensitivity-section", {"draft": 0, "pitch-0.5": 1, "two-rows": 2}),  # rows and pitch
    ],
)
def test_variants_differ_from_the_draft_in_their_choice_alone(study: str, choices: dict[str, int]) -> None:
    found = expand(load_sweep(study_file(study)))
    assert found[0].name == "draft_seed1"
    # The file writes the draft out: the two must stay the same.
    assert found[0].scene.fidelity == Fidelity(base="draft", **FIDELITIES["draft"])
    assert {point.scene.smarticle.aspect_ratio for point in found} == {0.7}
    for point in found:
        variant = str(point.values["variant"])
        twin = next(p for p in found if p.values["variant"] == "draft" and p.scene.seed == point.scene.seed)
        here, there = (flat(p.scene.model_dump()) for p in (point, twin))
        changed = {key for key in here if here[key] != there[key]}
        assert len(changed) == choices.get(variant, 1), (variant, changed)
        assert all(key.startswith(("fidelity.", "contact.")) for key in changed)


def flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in data.items():
        found |= flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
    return found


def test_every_data_file_of_a_study_is_named_in_its_readme() -> None:
    readme = (STUDIES / "README.md").read_text(encoding="utf-8")
    for path in STUDIES.glob("*.csv"):
        assert path.name in readme
