"""Means over seeds as columns and as cells, pairs of runs, and what must not be averaged."""

import math

import pandas as pd
import pytest

from postprocess.statistics.points import (
    ASPECT,
    SEED,
    SEEDS,
    averaged,
    counted,
    format_with_error,
    mean_difference,
    means_by,
    paired_differences,
    pairs,
    seeds_of,
)

FORCE = "force [N]"


@pytest.fixture
def group() -> pd.DataFrame:
    """Three seeds, of mean 2 N and standard error 1/√3 N."""
    return pd.DataFrame({SEED: [3, 1, 2], FORCE: [1.0, 2.0, 3.0], "height [m]": [math.nan, 0.1, math.nan]})


def test_means_carry_their_errors(group: pd.DataFrame) -> None:
    found = averaged(group, [FORCE, "height [m]"])
    assert list(found)[:3] == [FORCE, "force SE [N]", "force 95 % [N]"]
    error = 1 / math.sqrt(3)
    # Student's t with two degrees of freedom.
    assert list(found.values())[:3] == pytest.approx([2.0, error, 4.302653 * error])
    assert found["height [m]"] == 0.1
    assert math.isnan(found["height SE [m]"])
    assert seeds_of(group) == {SEEDS: 3, "seeds": "1 2 3"}


def test_a_mean_of_fewer_runs_than_its_row_has_states_their_number() -> None:
    runs = pd.DataFrame({"at": [1, 1, 1, 2], FORCE: [1.0, 2.0, 3.0, 4.0], "height [m]": [0.1, math.nan, 0.3, 0.4]})
    runs["of another phase [J]"] = [math.nan] * 3 + [1.0]
    means = means_by(runs, ["at"])
    assert means["runs [-]"].tolist() == [3, 1]
    assert means["height n [-]"].tolist() == [2, 1]
    assert means["height [m]"].tolist() == pytest.approx([0.2, 0.4])
    # None of its rows, or all of them, have a value.
    assert {counted("of another phase [J]"), counted(FORCE)}.isdisjoint(means.columns)


@pytest.mark.parametrize(
    ("value", "form", "error", "text"),
    [
        (0.1234, ".3f", 0.0049, "0.123 ± 0.005"),
        (3.0, "+.1f", 2.04, "+3.0 ± 2.0"),
        (-3.0, "+.1f", 2.04, "-3.0 ± 2.0"),
        (3.0, ".1f", math.nan, "3.0"),
        (3.0, ".1f", math.inf, "3.0"),
        (math.nan, ".1f", 1.0, "-"),
    ],
)
def test_numbers_have_the_error_that_there_is(value: float, form: str, error: float, text: str) -> None:
    assert format_with_error(value, form, error) == text


def test_runs_are_compared_pair_by_pair() -> None:
    # What seeds share, 10 and 20, is no scatter of the differences, 1 and 3; the third seed has no partner.
    one = pd.DataFrame({ASPECT: 0.7, SEED: [1, 2, 3], FORCE: [11.0, 23.0, 99.0]})
    other = pd.DataFrame({ASPECT: [0.7, 0.7, 0.4], SEED: [2, 1, 3], FORCE: [20.0, 10.0, 0.0]})
    assert pairs(one, other, FORCE)[["one", "other"]].to_numpy().tolist() == [[11, 10], [23, 20]]
    difference = mean_difference(one, other, FORCE)
    assert (difference.value, difference.standard_error, difference.count) == (2.0, pytest.approx(1.0), 2)


def test_numbers_that_differ_by_rounding_are_one_group() -> None:
    third = 0.1 + 0.2
    runs = pd.DataFrame({"x": [third, 0.3, 0.4, third, math.nan], FORCE: [1.0, 3.0, 5.0, 2.0, 7.0]})
    for column in (runs["x"], runs["x"].astype(object), -runs["x"]):
        means = means_by(runs.assign(x=column), ["x"])
        assert means["x"].abs().tolist()[:2] == [0.3, 0.4]
        assert means["runs [-]"].tolist() == [3, 1, 1]
        assert means[FORCE].tolist() == [2.0, 5.0, 7.0]
    near = pd.DataFrame({"x": [0.3, 0.3000001], FORCE: [1.0, 3.0]})
    assert len(means_by(near, ["x"])) == 2
    assert runs["x"].tolist()[0] == third  # the table itself is unchanged
    assert means_by(runs.iloc[:0], ["x"]).empty


def test_pairs_of_a_factor_are_found_in_spite_of_rounding() -> None:
    third = 0.1 + 0.2
    runs = pd.DataFrame({"x": [third, 0.4, 0.3, 0.4], "y": [third, 0.3, 1.0, 1.0], FORCE: [1.0, 3.0, 5.0, 9.0]})
    found = paired_differences(runs, FORCE, "x", (0.3, 0.4), ["y"])
    assert found[FORCE].tolist() == [2.0, 4.0]
