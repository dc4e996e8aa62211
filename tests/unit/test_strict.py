"""Values of files that are equal, and values that only look equal."""

from typing import Any

import numpy as np
import pytest

from dem.strict import equal


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (0.1 + 0.2, 0.3, True),
        (np.float64(0.1) * 3, 0.3, True),
        (1, 1.0, True),
        (1, 1 + 1e-12, True),
        (0.3, 0.300001, False),
        (0.0, 1e-300, False),
        (10**12, 10**12 + 1, False),  # seeds
        (np.int64(3), 3, True),
        (True, 1, False),
        (False, 0.0, False),
        (True, True, True),
        ("1", 1, False),
        ("007", "007", True),
        (None, None, True),
        (None, 0, False),
        ([0.1 + 0.2, "a"], [0.3, "a"], True),
        ([1], [1, 2], False),
        ({"a": 0.1 + 0.2}, {"a": 0.3}, True),
        ({"a": 1}, {"b": 1}, False),
        (float("nan"), float("nan"), False),
        (float("inf"), float("inf"), True),
    ],
)
def test_values_are_equal_if_they_differ_by_rounding_alone(one: Any, other: Any, *, expected: bool) -> None:
    assert equal(one, other) is expected
    assert equal(other, one) is expected
