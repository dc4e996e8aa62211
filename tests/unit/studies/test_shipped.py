"""The shipped studies: they expand, and say how the quick variant differs."""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from sweeps import of_one_seed

import studies
from dem.errors import InputError
from dem.phases.deposit import Deposit
from dem.phases.internal_oscillation import InternalOscillation
from dem.phases.relax import Relax
from dem.phases.shake import Shake
from dem.phases.shape_change import ShapeChange
from dem.setting.fidelity import FIDELITIES, Fidelity
from studies.base.shipped import differences
from studies.registry import STUDIES, Script, study_file
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep, on_engine

FOLDER = Path(studies.__file__).parent


@cache
def points_of(name: str, *, quick: bool = False) -> list[Point]:
    """Of a study, expanded once for all tests of this file."""
    return expand(load_sweep(study_file(name, quick=quick)))


def points(*, quick: bool) -> list[Point]:
    return points_of("gravish", quick=quick)


def test_the_full_study_is_the_papers() -> None:
    with (FOLDER / "savoie_counts.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    found = [point for point in points(quick=False) if not point.again]
    # Seed by seed, so that an interrupted study has all aspect ratios.
    assert [(p.scene.smarticle.aspect_ratio, p.scene.count, p.scene.seed) for p in found] == [
        (float(row["l_over_w"]), int(row["n"]), seed) for seed in range(1, 9) for row in rows
    ]
    assert len(found) == 64
    assert {point.scene.engine for point in found} == {"links"}
    assert found[3].name == "lw0.70_links_seed1"
    for point, row in zip(found[:8], rows, strict=True):
        deposit, rest, shake, again = point.scene.phases
        assert isinstance(deposit, Deposit)
        assert deposit.per_layer == int(row["per_layer"])
        assert isinstance(shake, Shake)
        assert (shake.duration_s, shake.frequency_hz, shake.peak_acceleration_g) == (20.0, 30, 2)
        assert isinstance(rest, Relax)
        assert isinstance(again, Relax)
        assert rest.duration_s == again.duration_s == 0.5


CODES = ("procedures", "fracture", "strength", "melting", "casting")
AGAIN = {"gravish": 9, "procedures": 6, "fracture": 8, "strength": 8, "melting": 8, "casting": 6}


@pytest.mark.parametrize("name", sorted(AGAIN))
def test_some_points_come_again_on_yade_from_the_same_poses(name: str) -> None:
    found = points_of(name)
    again = [point for point in found if point.again]
    assert again == found[-len(again) :]
    assert len(again) == AGAIN[name]
    for point in again:
        assert point.scene.engine == "yade"
        twin = next(p for p in found if p.name == point.name.replace("yade", "links"))
        # A name means knobs of its own on each engine; all else is the same, and so are seed and pour.
        assert twin.scene.fidelity.base == point.scene.fidelity.base
        assert twin.scene.model_copy(update={"engine": "yade", "fidelity": point.scene.fidelity}) == point.scene
        # What is random comes from the seed alone.
        assert twin.scene.seed_for("poses") == point.scene.seed_for("poses")


@pytest.mark.parametrize("name", sorted(set(STUDIES) - {"engines", "chain-bodies"}))
@pytest.mark.parametrize("engine", ["yade", "links"])
def test_every_study_runs_on_either_engine(name: str, engine: str) -> None:
    sweep = load_sweep(study_file(name))
    assert isinstance(sweep.content.constants["engine"], str)
    found = expand(on_engine(of_one_seed(sweep), engine))
    assert {point.scene.engine for point in found} == {engine}
    assert not any(point.again for point in found)


def test_chains_with_bodies_differ_from_those_without_in_the_bodies_and_the_walls_alone() -> None:
    bodies, plain = (points_of(name) for name in ("chain-bodies", "chain"))
    assert {point.scene.smarticle.middle_thickness_in_plane_m for point in bodies} == {0.021}
    twins = {(p.values["variant"], p.values["count"], p.scene.seed): p.scene for p in plain}
    for point in bodies:
        twin = twins["baseline", point.values["count"], point.scene.seed]
        alike = {"engine": "yade", "plane": point.scene.plane, "smarticle": point.scene.smarticle}
        assert twin.model_copy(update={**alike, "fidelity": point.scene.fidelity}) == point.scene
        assert twin.smarticle.model_copy(update={"middle_thickness_in_plane_m": 0.021}) == point.scene.smarticle
        assert point.scene.plane is not None
        assert point.scene.plane.width_m == pytest.approx(0.062 / point.values["h_over_H"])


def test_chains_with_bodies_have_one_engine() -> None:
    with pytest.raises(InputError, match=r"middle_thickness_in_plane_m: 0\.021 m on engine: links.*use engine: yade"):
        expand(on_engine(load_sweep(study_file("chain-bodies")), "links"))


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", CODES)
def test_a_study_by_the_papers_code_differs_in_the_protocol_alone(name: str, quick: bool) -> None:
    """Point by point, in the same order: what else differs in the scene is what the protocol says.

    By the code there may be further seeds.
    """
    text, code = (points_of(one, quick=quick) for one in (name, f"{name}-code"))
    seeds = {point.scene.seed for point in text}
    code = [point for point in code if point.scene.seed in seeds]
    assert len(text) == len(code) > 0
    for one, other in zip(text, code, strict=True):
        assert one.name == other.name
        alike = {"protocol": "code", "title": f"{name}-code"}
        assert {**one.values, **alike} == other.values
        assert (one.scene.protocol, other.scene.protocol) == ("text", "code")
        assert (one.scene.motor.law, other.scene.motor.law) == ("halt", "ease")
        assert (one.scene.contact.friction_smarticle, other.scene.contact.friction_smarticle) == (0.4, 0.2)
        assert (one.scene.contact.friction_wall, other.scene.contact.friction_wall) == (0.4, 0.2)
        for phase, twin in zip(one.scene.phases, other.scene.phases, strict=True):
            if isinstance(phase, Shake) and isinstance(twin, Shake):
                assert (phase.moves, twin.moves) == ("container", "floor")
            else:
                assert phase == twin
        assert one.scene.seed_for("poses") == other.scene.seed_for("poses")


def test_the_study_of_engines_pairs_every_run() -> None:
    for quick in (False, True):
        found = points_of("engines", quick=quick)
        assert len(found) == (20 if quick else 120)
        for point in found:
            assert point.scene.name == f"{point.values['case']}/{point.values['variant']}"
            assert point.scene.engine == ("links" if point.values["variant"] == "links" else "yade")
        names = {point.name for point in found}
        assert {name.replace("_links_", "_yade_") for name in names} <= names
        piles = [point for point in found if point.values["case"] != "chain"]
        pitches = {point.values["variant"]: point.scene.fidelity.pitch for point in piles}
        assert pitches["yade"] == 1.0
        assert pitches["pitch-0.5"] == 0.5
    sweep = load_sweep(study_file("engines"))
    with pytest.raises(InputError, match=r"'engine' is a variable.*; leave --engine links out"):
        on_engine(sweep, "links")


def test_the_counts_are_those_of_the_reference() -> None:
    """The layers of the source times the number per layer are its counts."""
    with (FOLDER / "savoie_counts.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            assert int(row["layers"]) * int(row["per_layer"]) == int(row["n"])


def test_the_quick_variant_shakes_five_aspect_ratios_for_gravishs_time_and_yade_for_less() -> None:
    found = points(quick=True)
    once, again = [p for p in found if not p.again], [p for p in found if p.again]
    assert {p.scene.smarticle.aspect_ratio for p in once} == {0.4, 0.5, 0.7, 0.9, 1.0}
    assert {p.scene.seed for p in once} == {1, 2, 3}
    assert {(p.scene.engine, p.values["shake_s"]) for p in once} == {("links", 20.0)}
    assert [(p.scene.engine, p.scene.smarticle.aspect_ratio, p.values["shake_s"]) for p in again] == [
        ("yade", ratio, 1.5) for ratio in (0.4, 0.7, 1.0)
    ]


def test_the_quick_variant_says_how_it_differs() -> None:
    lines = differences(points(quick=True), points(quick=False))
    assert lines[0] == "18 runs instead of 73"
    assert "l_over_w: only 0.4, 0.5, 0.7, 0.9, 1.0 of 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1" in lines
    assert "shake_s: 1.5 instead of 20.0" in lines
    assert "seed: only 1, 2, 3 of 1, 2, 3, 4, 5, 6, 7, 8" in lines
    # Columns that follow from l/w, and what is the same, are not told.
    assert not any(line.startswith(("n:", "layers:", "engine:", "title:")) for line in lines)


def test_nothing_differs_from_itself() -> None:
    assert differences(points(quick=False), points(quick=False)) == []


def test_an_unknown_study_is_an_input_error() -> None:
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
    found = points_of(study)
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


AMPLITUDES = (5, 10, 15, 20, 30)
RATIOS, RATIOS_OF_AMPLITUDES = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1), (0.4, 0.5, 0.7, 1.0)


def procedures(*, quick: bool) -> list[Point]:
    return points_of("procedures", quick=quick)


def test_the_procedures_are_those_of_the_paper() -> None:
    every = procedures(quick=False)
    assert len(every) == 326
    assert len({point.scene_sha256 for point in every}) == 326
    # Around the maximum of energy that the paper sees there are sixteen seeds.
    more = {
        (point.values["procedure"], point.values["theta_deg"], point.values["l_over_w"]) for point in every[296:320]
    }
    assert more == {("internal", 10, ratio) for ratio in (0.8, 0.9, 1.0)}
    found = every[:296]
    # Seed by seed, so that an interrupted study has all points.
    assert [point.scene.seed for point in found] == [seed for seed in range(1, 9) for _ in range(37)]
    counts = {0.4: (494, 13), 0.5: (390, 13), 0.6: (308, 11), 0.7: (270, 10), 0.8: (260, 10), 0.9: (225, 9)}
    counts |= {1.0: (192, 8), 1.1: (168, 7)}
    for point in found:
        deposit, rest, activity, again = point.scene.phases
        assert isinstance(deposit, Deposit)
        assert isinstance(rest, Relax)
        assert isinstance(again, Relax)
        assert rest.duration_s == again.duration_s == 0.5
        assert (point.scene.count, deposit.per_layer) == counts[point.scene.smarticle.aspect_ratio]
        assert point.scene.fidelity.base == "standard"
        assert point.scene.protocol == "text"
        assert point.scene.recording.energy
        # Torque and angle together every 0.1 s, as the paper's code kept them, are every second frame.
        assert point.scene.recording.frame_interval_s == 0.05
        if isinstance(activity, Shake):
            assert (activity.duration_s, activity.frequency_hz, activity.peak_acceleration_g) == (20.0, 30, 2)
        elif isinstance(activity, ShapeChange):
            assert (activity.straight_deg, activity.opening_s, activity.closing_s) == (0, 1.5, 1.5)
        else:
            assert isinstance(activity, InternalOscillation)
            assert activity.theta_deg == point.values["theta_deg"]
            assert activity.scaled
            assert activity.duration_s == 5.0


@pytest.mark.parametrize("activity", [Shake, ShapeChange])
def test_every_procedure_is_run_at_every_aspect_ratio(activity: type) -> None:
    found = procedures(quick=False)[:37]
    ratios = [point.scene.smarticle.aspect_ratio for point in found if isinstance(point.scene.phases[2], activity)]
    assert tuple(ratios) == RATIOS


def test_amplitudes_are_left_out_by_the_rule_of_the_hinge() -> None:
    """90° + θ/2 · 0.7/(l/w) is at most 105°; every other combination is there, and none twice."""
    found = [
        (point.scene.smarticle.aspect_ratio, activity.theta_deg)
        for point in procedures(quick=False)[:37]
        if isinstance(activity := point.scene.phases[2], InternalOscillation)
    ]
    wanted = {(ratio, 10.0) for ratio in RATIOS}
    wanted |= {
        (ratio, float(theta))
        for ratio in RATIOS_OF_AMPLITUDES
        for theta in AMPLITUDES
        if theta * 0.7 / ratio <= 30 * (1 + 1e-9)
    }
    assert sorted(found) == sorted(wanted)
    assert len(wanted) == len(RATIOS) + 13


def test_the_quick_procedures_say_how_they_differ() -> None:
    found = procedures(quick=True)
    assert len(found) == 36
    lines = differences(found, procedures(quick=False))
    assert lines[0] == "36 runs instead of 326"
    assert {"share: 0.25 instead of 1.0", "shake_s: 2.0 instead of 20.0"} <= set(lines)
    assert "oscillate_s: 2.0 instead of 5.0" in lines
    assert "l_over_w: only 0.4, 0.7, 1.0 of 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1" in lines
    assert "theta_deg: only 0, 10, 30 of 0, 5, 10, 15, 20, 30" in lines
    assert "seed: only 1, 2, 3 of 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16" in lines


def test_the_code_and_the_factors_go_by_the_same_points() -> None:
    by_text, by_code = procedures(quick=False), points_of("procedures-code")
    assert [point.name for point in by_code] == [point.name for point in by_text]
    assert {point.scene.protocol for point in by_code} == {"code"}
    assert {point.scene.motor.law for point in by_code} == {"ease"}
    factors = points_of("factors")
    rules = {(p.scene.motor.law, p.scene.contact.friction_wall, p.scene.container.radius_m) for p in factors}
    assert rules == set(product(("halt", "ease"), (0.4, 0.2), (0.0234, 0.0224)))
    assert len(factors) == len(rules) * 2 * 8


def test_every_sweep_file_is_that_of_a_study_in_the_registry() -> None:
    # The list of claims is no sweep.
    files = {path.name.removesuffix(".yaml") for path in FOLDER.glob("*/*.yaml") if path.parent.name != "claims"}
    scripts = {study.name for study in STUDIES.values() if isinstance(study, Script)}
    assert {name for name in files if "." not in name} | scripts == set(STUDIES)


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_is_what_the_registry_calls_it(name: str) -> None:
    shipped = STUDIES[name]
    assert shipped.load(quick=True).name == name
    variables = expand(of_one_seed(load_sweep(shipped.sweep_file())))[0].values
    assert set(shipped.pictured) <= set(variables)


def test_what_is_known_of_studies_beforehand_loads_nothing_large() -> None:
    code = "import sys, studies.registry; print(*{name.split('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "studies" in loaded
    assert not {"pandas", "matplotlib", "numpy", "pyvista", "yade"} & set(loaded)


def test_every_data_file_of_a_study_is_named_in_its_readme() -> None:
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    for path in FOLDER.glob("*/*.csv"):
        assert path.name in readme
