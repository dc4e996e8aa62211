"""Measures that a user defines: columns of numbers, arrays and mappings in tables of frames and of phases."""

import pickle

import numpy as np
import pytest

from dem.errors import InputError
from dem.record.run import Run
from postprocess.geometry.links import UndefinedMeasureError
from postprocess.measures.registry import measure_of
from postprocess.measures.table import measure_run, summarise_run


def table_of(directory, function, *, frames=True):
    return (measure_run if frames else summarise_run)(Run(directory), measures=[measure_of(function)])


def test_an_array_fills_a_column_per_number(make_run):
    def heights_m(frame, _run):
        return frame.vertices[..., 2].mean(axis=1)[:2]

    directory = make_run()
    table, run = table_of(directory, heights_m), Run(directory)
    each = run.frames[2].vertices[..., 2].mean(axis=1)
    assert table["heights 1 [m]"][2] == pytest.approx(each[1])
    assert np.isnan(table["heights 1 [m]"][0])  # the first frame has one smarticle
    assert table["heights 0 [m]"].notna().all()
    phases = table_of(directory, heights_m, frames=False)
    assert phases["heights 1 [m]"].iloc[-1] == pytest.approx(each[1])
    assert "heights 1 SE [m]" in phases


def test_a_dict_fills_columns_with_its_own_names_and_units(make_run):
    def own(frame, _run):
        return {"top_m": frame.vertices[..., 2].max(), "spin_rad_per_s": np.array([[1, 2], [3, 4]]), "seen": True}

    row = table_of(make_run(), own).iloc[-1]
    assert row["top [m]"] > 0
    assert [row[f"spin {k} {j} [rad/s]"] for k in (0, 1) for j in (0, 1)] == [1, 2, 3, 4]
    assert row["seen [-]"] == 1


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("pressure_Pa", "pressure [Pa]"),
        ("inertia_kg_m2", "inertia [kg m²]"),
        ("speed_mm_per_s", "speed [mm/s]"),
        ("area_mm2", "area [mm²]"),
        ("taps_per_s", "taps [1/s]"),
        ("stiffness_N_m_per_rad", "stiffness [N m/rad]"),
        ("phi", "phi [-]"),
    ],
)
def test_the_end_of_a_name_is_the_unit_of_its_column(make_run, name, column):
    assert column in table_of(make_run(), lambda _frame, _run: {name: 1.0})


def test_a_number_fills_one_column_which_is_nan_where_it_is_undefined(make_run):
    def mean_speed_m_per_s(frame, _run):
        if frame.count < 2:
            raise UndefinedMeasureError("needs 2")
        return 3

    assert table_of(make_run(), mean_speed_m_per_s)["mean speed [m/s]"].tolist() == pytest.approx(
        [np.nan, 3, 3], nan_ok=True
    )


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("high", ["measure wrong:", "'high'"]),
        (None, ["measure wrong:", "null"]),
        ({"top_m": [1, 2], "word": "high"}, ["measure wrong, 'word'", "'high'"]),
        ([[1, 2], [3]], ["measure wrong:", "[[1, 2], [3]]"]),
        ({"com height_m": 1.0}, ["measure wrong: the table has a column 'com height [m]' already"]),
    ],
)
def test_other_values_and_taken_names_are_rejected(make_run, value, words):
    def wrong(_frame, _run):
        return value

    with pytest.raises(InputError) as error:
        table_of(make_run(), wrong)
    assert all(word in str(error.value) for word in words), error.value
    assert "\n" not in str(error.value)


def count_of(frame, _run):
    return frame.count


def test_other_processes_can_take_a_measure():
    assert pickle.loads(pickle.dumps(measure_of(count_of))).name == "count_of"
