"""The fidelity chosen from a measured table: by error, by hours, by both, and what is said where none will do."""

from dataclasses import replace
from pathlib import Path

import pytest

from dem.errors import InputError
from dem.plan.choice import Error, Measured, choose, pick, read_table
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

HEADER = (
    "knob,value,unit,variant,seeds [-],aspect ratio [-],smarticles [-],activity,"
    "processor time over expected wall time [-],"
    "phi_0 error [%],phi_0 error 95 % [%],phi_f error [%],phi_f error 95 % [%],"
    "crossings error [%],crossings error 95 % [%],verdict"
)
TABLE = f"""\
{HEADER}
time-step,0.9,,base,3,0.7,60,shake,1.5,0.1,1,0.1,1,0.1,1,not resolved
fidelity,draft,,base,3,0.7,60,shake,1.5,-2,1.5,6,2,-30,12,resolved
fidelity,standard,,standard,3,0.7,60,shake,2,1,1.5,-2,2,-20,10,not resolved
fidelity,reference,,reference,3,0.7,60,shake,1,0,1,0,1.2,0,5,reference
# Study accuracy, …
"""


def scene_of(**changes: object) -> Scene:
    phases = [{"type": "deposit"}, {"type": "relax"}, {"type": "shake", "duration_s": 2}]
    return parse_scene({"schema_version": 1, "seed": 1, "count": 60, "phases": phases, **changes}, source="test")


@pytest.fixture
def table_file(tmp_path: Path) -> Path:
    file = tmp_path / "table.csv"
    file.write_text(TABLE, encoding="utf-8")
    return file


def expected(fidelity: str, error: float, hours: float, *, band: float = 0.01) -> Measured:
    errors = (Error(of="φ_0", value=error / 2, band=band), Error(of="φ_f", value=-error, band=band))
    exact = fidelity == "reference"
    return Measured(fidelity=fidelity, errors=errors, seeds=3, ratio=1.0, is_reference=exact, hours=hours)


THREE = [expected("draft", 0.06, 0.5), expected("standard", 0.02, 2.0), expected("reference", 0.0, 30.0)]


def test_a_table_is_read(table_file: Path) -> None:
    table = read_table(table_file)
    assert [one.fidelity for one in table.fidelities] == ["draft", "standard", "reference"]
    assert (table.aspect_ratio, table.count, table.activity) == (0.7, 60, "shake")
    draft = table.fidelities[0]
    assert draft.ratio == 1.5
    assert draft.worst == Error(of="φ_f", value=0.06, band=0.02)
    assert [one.is_reference for one in table.fidelities] == [False, False, True]


@pytest.mark.parametrize(
    ("max_error", "max_hours", "picked"),
    [
        (0.1, None, "draft"),
        (0.03, None, "standard"),
        (0.01, None, "reference"),
        (None, 1.0, "draft"),
        (None, 4.0, "standard"),
        (None, 100.0, "reference"),
        (0.03, 4.0, "standard"),
        (0.1, 100.0, "draft"),
    ],
)
def test_the_cheapest_within_the_error_or_the_finest_within_the_hours(
    max_error: float | None, max_hours: float | None, picked: str
) -> None:
    assert pick(THREE, max_error=max_error, max_hours=max_hours)[0].fidelity == picked


@pytest.mark.parametrize(
    ("max_error", "max_hours", "message"),
    [
        (
            0.01,
            4.0,
            "--max-error 0.01 and --max-hours 4 contradict each other: reference on yade, the cheapest within the "
            "error, is expected to take 30 h; accuracy goes first, so the hours give way: --max-hours 30; or accept "
            r"standard on yade \(φ_f -0.020 ± 0.010\) with --max-error 0.02",
        ),
        (0.03, 0.1, "so the hours give way: --max-hours 2$"),
        (
            None,
            0.1,
            "--max-hours 0.1: even draft on yade is expected to take 0.5 h; give --max-hours 0.5 or a smaller scene",
        ),
    ],
)
def test_limits_that_cannot_be_kept_say_which_gives_way(
    max_error: float | None, max_hours: float | None, message: str
) -> None:
    with pytest.raises(InputError, match=message) as error:
        pick(THREE, max_error=max_error, max_hours=max_hours)
    assert "\n" not in str(error.value)


def test_hours_are_the_planned_ones_times_the_ratio_measured(table_file: Path) -> None:
    scene = scene_of(fidelity={"base": "draft", "pitch": 1.1})
    chosen = choose(scene, read_table(table_file), max_error=0.03)
    assert chosen.expected.fidelity == "standard"
    plain = plan(scene_of(fidelity="standard"))
    assert chosen.expected.hours == pytest.approx(2 * plain.wall_s / 3600)
    # The plan that is shown beside it has the same hours: one number stands.
    assert chosen.planned == plain.corrected(2)
    assert chosen.planned.wall_s / 3600 == pytest.approx(chosen.expected.hours)
    assert sum(phase.wall_s for phase in chosen.planned.phases) == pytest.approx(chosen.planned.wall_s)
    text = chosen.to_text()
    assert text.startswith("engine yade, fidelity standard: the cheapest within --max-error 0.03\n")
    assert "φ_0 +0.010 ± 0.015, φ_f -0.020 ± 0.020 (3 seeds)" in text
    assert text.endswith("use it: --engine yade --set fidelity=standard")
    assert chosen.to_dict()["errors"][1] == {"of": "φ_f", "value": -0.02, "band": 0.02}


BOTH = f"""\
{HEADER}
fidelity,draft,,base,3,0.7,60,shake,1.5,-9,1.5,9,2,-30,12,resolved
fidelity,reference,,x,3,0.7,60,shake,1,0,1,0,1.2,0,5,reference
engine,yade draft,,yade-draft,3,0.7,60,shake,1.5,-2,1.5,6,2,-30,12,resolved
engine,yade standard,,yade-standard,3,0.7,60,shake,1,1,1.5,-2,2,-20,10,not resolved
engine,yade reference,,yade-reference,0,,,,,,,,,,,unknown
engine,links draft,,links-draft,20,0.7,60,shake,1,3,1,7,1,-20,2,resolved
engine,links standard,,base,20,0.7,60,shake,1,1,1,2,1,-20,2,resolved
engine,links reference,,x,20,0.7,60,shake,1,-1,1,0.5,1.2,1,5,not resolved
engine,links converged,,y,20,0.7,60,shake,1,0,1,0,1.2,0,5,reference
"""


def test_engines_are_chosen_between_against_one_reference(tmp_path: Path) -> None:
    file = tmp_path / "both.csv"
    file.write_text(BOTH, encoding="utf-8")
    table = read_table(file)
    assert table.reference == "links converged"
    names = [one.name for one in table.fidelities]
    assert names == ["draft on links", "standard on links", "reference on links", "draft on yade", "standard on yade"]
    scene = scene_of()
    chosen = choose(scene, table, max_error=0.03)
    assert (chosen.expected.engine, chosen.expected.fidelity) == ("links", "standard")
    assert chosen.planned == plan(scene_of(engine="links", fidelity="standard")).corrected(1)
    assert chosen.to_text().startswith("engine links, fidelity standard: the cheapest within --max-error 0.03\n")
    assert chosen.to_text().endswith("use it: --engine links --set fidelity=standard")
    assert chosen.to_dict()["engine"] == "links"
    # The reference where the hours allow it, whatever stands before or after it in the table.
    assert choose(scene, table, max_hours=1e6).expected.name == "reference on links"
    own = choose(scene, read_table(file, engine="yade"), max_error=0.03)
    assert (own.expected.engine, own.expected.fidelity) == ("yade", "standard")
    assert not any("no finished runs" in note for note in own.notes)


def test_of_what_the_hours_allow_the_most_exact_is_taken() -> None:
    links = replace(THREE[0], engine="links", hours=0.1)
    assert pick([*THREE[:2], links], max_error=None, max_hours=4)[0] is THREE[1]
    exact = replace(expected("standard", 0.01, 0.1), engine="links")
    assert pick([*THREE[:2], exact], max_error=None, max_hours=4)[0] is exact
