"""Sweep files: what they may say, and the points they give."""

from pathlib import Path

import pytest
from sweep_cases import SCENE, SWEEP, WriteSweep

from dem.errors import InputError
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep, on_engine, parse_table, read_text

COUNTS = "l_over_w,n,label\n0.4,494,long\n0.7,270,middle\n1.0,192,short\n"


def points(sweep: str, write_sweep: WriteSweep, **others: str) -> list[Point]:
    return expand(load_sweep(write_sweep(sweep, **others)))


def sweep_with(points_text: str, run_name: str = "{{ count }}-{{ seed }}", more: str = "") -> str:
    return f"""\
schema_version: 1
name: test
template: scene.yaml.j2
run_name: "{run_name}"
points: {points_text}
{more}
"""


def test_grid_is_crossed_with_the_seeds(write_sweep: WriteSweep) -> None:
    found = points(SWEEP, write_sweep)
    assert [point.name for point in found] == ["n10_seed1", "n10_seed2", "n20_seed1", "n20_seed2"]
    assert [(point.scene.count, point.scene.seed) for point in found] == [(10, 1), (10, 2), (20, 1), (20, 2)]
    assert len({point.scene_sha256 for point in found}) == 4


def test_seed_by_seed_all_points_have_the_first_seed_first(write_sweep: WriteSweep) -> None:
    text = SWEEP.replace("{seeds: [1, 2]}", "{seeds: [2, 1], seed_by_seed: true}")
    found = points(text, write_sweep)
    assert [point.name for point in found] == ["n10_seed2", "n20_seed2", "n10_seed1", "n20_seed1"]
    assert {point.scene_sha256 for point in found} == {point.scene_sha256 for point in points(SWEEP, write_sweep)}


AGAIN = """\
schema_version: 1
name: test
template: scene.yaml.j2
run_name: "{{ engine }}{{ count }}_seed{{ seed }}"
constants: {engine: links, share: 1.0}
points:
  grid: {n: [10, 20]}
derived: {count: (share * n) | int}
repeats: {seeds: [1, 2]}
again: {constants: {engine: yade, share: 0.5}, only: {n: [20], seed: [2]}}
"""
ENGINE_SCENE = SCENE.replace("seed:", "engine: {{ engine }}\nseed:")


def test_some_points_come_again_with_other_constants(write_sweep: WriteSweep) -> None:
    found = points(AGAIN, write_sweep, scene=ENGINE_SCENE)
    names = ["links10_seed1", "links10_seed2", "links20_seed1", "links20_seed2", "yade10_seed2"]
    assert [point.name for point in found] == names
    assert [point.again for point in found] == [False] * 4 + [True]
    # What is derived follows.
    assert (found[-1].scene.engine, found[-1].scene.count) == ("yade", 10)


def test_on_one_engine_nothing_comes_again(write_sweep: WriteSweep) -> None:
    sweep = load_sweep(write_sweep(AGAIN, scene=ENGINE_SCENE))
    assert [point.name for point in expand(on_engine(sweep, "yade"))] == [
        "yade10_seed1",
        "yade10_seed2",
        "yade20_seed1",
        "yade20_seed2",
    ]
    with pytest.raises(InputError, match="there is no 'engine' that could be links"):
        on_engine(load_sweep(write_sweep(SWEEP)), "links")
    grid = AGAIN.replace("{n: [10, 20]}", "{n: [10, 20], engine: [links, yade]}").replace("engine: links, ", "")
    grid = grid.replace("engine: yade, ", "")
    with pytest.raises(InputError, match="'engine' is a variable, so its runs are on several"):
        on_engine(load_sweep(write_sweep(grid, scene=ENGINE_SCENE)), "links")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed: [2]", "sead: [2]", r"again.only.sead: no such variable; did you mean 'seed'\?"),
        ("seed: [2]", "seed: [3]", "again.only.seed: no point has 3; there are 1, 2"),
        ("constants: {engine: yade,", "constants: {enigne: yade,", "'enigne' is none of the constants"),
        ("only:", "olny:", r"again: unknown key 'olny'; did you mean 'only'\?"),
    ],
)
def test_what_comes_again_must_be_known(write_sweep: WriteSweep, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        points(AGAIN.replace(old, new), write_sweep, scene=ENGINE_SCENE)


MORE = """\
schema_version: 1
name: test
template: scene.yaml.j2
run_name: "n{{ count }}_seed{{ seed }}"
points:
  grid: {count: [10, 20, 30]}
repeats: {seeds: [1, 2], seed_by_seed: true, more: {seeds: [7, 3], only: {count: [30, 10]}}}
"""


@pytest.mark.parametrize("seed_by_seed", [True, False])
def test_some_points_have_more_seeds_after_those_of_all(write_sweep: WriteSweep, *, seed_by_seed: bool) -> None:
    found = points(MORE if seed_by_seed else MORE.replace("seed_by_seed: true, ", ""), write_sweep)
    assert sorted(point.name for point in found[:6]) == sorted(f"n{n}_seed{s}" for n in (10, 20, 30) for s in (1, 2))
    assert [point.name for point in found[6:]] == ["n10_seed7", "n30_seed7", "n10_seed3", "n30_seed3"]
    assert [(point.scene.seed, point.scene.count) for point in found[6:]] == [(7, 10), (7, 30), (3, 10), (3, 30)]
    assert not any(point.again for point in found)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("only: {count: [30, 10]}", "only: {cuont: [30]}", r"repeats.more.only.cuont: no such variable; did you mean"),
        ("only: {count: [30, 10]}", "only: {count: [31]}", "repeats.more.only.count: no point has 31; there are 10,"),
        ("seeds: [7, 3]", "seeds: [7, 2]", "more.seeds: 2 is one of `seeds` already"),
    ],
)
def test_more_seeds_must_be_of_known_points(write_sweep: WriteSweep, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        points(MORE.replace(old, new), write_sweep)


def test_table_rows_are_points_and_derived_values_follow(write_sweep: WriteSweep) -> None:
    text = sweep_with(
        "{table: {file: counts.csv}}", more="derived: {half: n / 2, count: half | int, fixed: 3}\nrepeats: {seeds: [1]}"
    )
    found = points(text, write_sweep, counts_csv=COUNTS)
    assert [point.scene.count for point in found] == [247, 135, 96]
    assert found[0].values == {
        "l_over_w": 0.4,
        "n": 494,
        "label": "long",
        "half": 247.0,
        "count": 247,
        "fixed": 3,
        "seed": 1,
    }


def test_table_keeps_only_the_wanted_rows(write_sweep: WriteSweep) -> None:
    text = sweep_with(
        "{table: {file: counts.csv, only: {l_over_w: [1.0, 0.4]}}}", more="derived: {count: n}\nrepeats: {seeds: [1]}"
    )
    found = points(text, write_sweep, counts_csv=COUNTS)
    assert [point.values["l_over_w"] for point in found] == [0.4, 1.0]


@pytest.mark.parametrize(
    ("cell", "value"),
    [
        *[(text, text) for text in ("1_2", "007", "-007", "00.5", "1_0e3", "１２", "0x10", "no", "rough")],
        *[("12", 12), ("-3", -3), ("0", 0), ("0.5", 0.5), (".5", 0.5), ("1.", 1.0), ("1e-3", 0.001), ("1E3", 1000.0)],
        *[("true", True), ("True", True), ("FALSE", False)],
    ],
)
def test_cells_of_a_table_are_numbers_booleans_or_text(cell: str, value: object) -> None:
    (row,) = parse_table(f"a\n {cell} \n", "table.csv")
    assert (row["a"], type(row["a"])) == (value, type(value))


def test_a_table_varies_a_boolean(write_sweep: WriteSweep) -> None:
    text = sweep_with(
        "{table: {file: flags.csv}}",
        run_name="n{{ count }}_{{ 'open' if forces else 'shut' }}",
        more="constants: {seed_: 1}",
    )
    scene = SCENE.replace("seed }}", "seed_ }}") + "recording: {contact_forces: {{ forces }}}\n"
    found = points(text, write_sweep, scene=scene, flags_csv="count,forces\n10,true\n20,false\n")
    assert [(point.name, point.scene.recording.contact_forces) for point in found] == [
        ("n10_open", True),
        ("n20_shut", False),
    ]


def test_a_byte_order_mark_is_no_part_of_a_text(write_sweep: WriteSweep) -> None:
    mark = "\ufeff"
    text = sweep_with("{table: {file: counts.csv}}", more="derived: {count: n}\nrepeats: {seeds: [1]}")
    found = points(mark + text, write_sweep, scene=mark + SCENE, counts_csv=mark + COUNTS)
    assert [point.scene.count for point in found] == [494, 270, 192]
    folder = write_sweep(text, quoted_csv=f'{mark}"a",b\n1,2\n').parent
    assert parse_table(read_text(folder / "quoted.csv", "table"), "table") == [{"a": 1, "b": 2}]


def test_conditions_hold_for_numbers_that_differ_by_rounding(write_sweep: WriteSweep) -> None:
    third = "l_over_w,count\n0.30000000000000004,10\n0.4,20\n1,30\n"
    text = sweep_with(
        "{table: {file: t.csv, only: {l_over_w: [0.3, 1.0]}}}", run_name="{{ count }}", more="repeats: {seeds: [1]}"
    )
    assert [point.name for point in points(text, write_sweep, t_csv=third)] == ["10", "30"]
    more = MORE.replace("grid: {count: [10, 20, 30]}", "zip: {count: [10, 20], x: [0.30000000000000004, 0.4]}")
    found = points(more.replace("{count: [30, 10]}", "{x: [0.3]}"), write_sweep)
    assert [point.name for point in found[4:]] == ["n10_seed7", "n10_seed3"]


def test_a_boolean_is_no_number_in_conditions(write_sweep: WriteSweep) -> None:
    text = sweep_with("{table: {file: t.csv, only: {flag: [1]}}}", run_name="{{ count }}", more="repeats: {seeds: [1]}")
    with pytest.raises(InputError, match="has 1; there are True, False"):
        points(text, write_sweep, t_csv="flag,count\ntrue,10\nfalse,20\n")


def test_sources_are_crossed_and_the_later_varies_faster(write_sweep: WriteSweep) -> None:
    text = sweep_with(
        "{grid: {count: [1, 2]}, list: [{a: 1}, {a: 2}]}", run_name="{{ a }}{{ count }}", more="constants: {seed_: 5}"
    )
    scene = SCENE.replace("seed }}", "seed_ }}").replace("name: test", "name: t{{ a }}")
    found = points(text, write_sweep, scene=scene)
    assert [point.name for point in found] == ["11", "12", "21", "22"]
    assert {point.scene.seed for point in found} == {5}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a sweep file holds keys such as template and points: got null"),
        ("a: [", "line 1, column 5: not valid YAML"),
        (SWEEP.replace("run_name", "runname"), r"unknown key 'runname'; did you mean 'run_name'?"),
        (SWEEP.replace("name: test\n", ""), "name: missing; it has no default, see `smarticles sweep --help`"),
        (SWEEP + "derived: {half: [1]}\n", r"derived.half: \[1\] is neither an expression nor a number; write it"),
        (SWEEP.replace("{count: [10, 20]}", "{count: []}"), "grid: count has no values"),
        (SWEEP.replace("[1, 2]", "[1, 1]"), r"a seed is given twice: got \[1, 1\]"),
        (SWEEP.replace("[10, 20]", "[10, .nan]"), "nan is not a finite number"),
        (SWEEP.replace("{count:", "{co-unt:"), "'co-unt' cannot name a variable"),
        (sweep_with("{}"), "no points: give at least one of table, list, zip, grid"),
        (sweep_with("{zip: {a: [1], b: [1, 2]}}"), "zip: lists of unequal length"),
        (sweep_with("{list: [{a: 1}, {b: 1}]}"), "every point needs the same variables"),
        (SWEEP.replace("scene.yaml.j2", "absent.j2"), "absent.j2: cannot read the scene template"),
        (
            sweep_with("{table: {file: counts.csv, only: {l_over: [1]}}}"),
            "points.table.only.l_over: no such column; did you mean 'l_over_w'?",
        ),
        (
            sweep_with("{table: {file: counts.csv, only: {l_over_w: [0.5]}}}"),
            "no row of .*counts.csv has 0.5; there are 0.4, 0.7, 1.0",
        ),
        (sweep_with("{table: {file: ragged.csv}}"), r"ragged.csv, row 3: expected 2 filled cells"),
        (sweep_with("{table: {file: header.csv}}"), "line 1: column 'l/w' cannot be a variable"),
    ],
)
def test_bad_sweep_files_are_input_errors(text: str, message: str, write_sweep: WriteSweep) -> None:
    file = write_sweep(text, counts_csv=COUNTS, ragged_csv="a,b\n1,2\n3\n", header_csv="l/w,n\n1,2\n")
    with pytest.raises(InputError, match=message) as caught:
        load_sweep(file)
    assert "\n" not in str(caught.value)
    assert str(file.parent) in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("n{{ count }}_", "n{{ cuont }}_", "run_name.*'cuont' is undefined; did you mean 'count'?"),
        (
            "n{{ count }}_",
            "n_",
            "two runs are called 'n_seed1': count 10 and 20; put what differs into run_name",
        ),
        (
            "n{{ count }}_",
            "{{ 'N' if count > 10 else 'n' }}_",
            "the names 'n_seed1' and 'N_seed1' differ in upper and lower case only",
        ),
        ("[10, 20]", "[10, 20, 10]", "points: n10_seed1 is given twice with equal values; remove one of the two"),
        ("[10, 20]", "[10, 10.0]", "n10_seed1 and n10.0_seed1 have identical scenes although count 10 and 10.0"),
        ("n{{ count }}_", "../{{ count }}", "gives '../10seed1', which cannot be a directory"),
        ("repeats:", "derived: {count: 3}\nrepeats:", "'count' is set in both points.grid and derived"),
        ("repeats:", "derived: {x: contu}\nrepeats:", "derived.x = 'contu': 'contu' is undefined"),
        ("[10, 20]", "[10, -20]", r"scene.yaml.j2, rendered for run n-20_seed1: count: .*-20"),
    ],
)
def test_bad_points_are_input_errors(old: str, new: str, message: str, write_sweep: WriteSweep) -> None:
    assert old in SWEEP
    sweep = load_sweep(write_sweep(SWEEP.replace(old, new)))
    with pytest.raises(InputError, match=message) as caught:
        expand(sweep)
    assert "\n" not in str(caught.value)


def test_a_variable_that_changes_nothing_is_an_error(write_sweep: WriteSweep) -> None:
    sweep = load_sweep(write_sweep(scene=SCENE.replace("{{ count }}", "10")))
    with pytest.raises(InputError, match=r"n10_seed1 and n20_seed1 have identical scenes .*count 10"):
        expand(sweep)


def test_not_text_is_an_input_error(tmp_path: Path) -> None:
    file = tmp_path / "sweep.yaml"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"sweep.yaml: not UTF-8 text \(byte 0\)"):
        load_sweep(file)
