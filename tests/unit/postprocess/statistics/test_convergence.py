"""The observed order of made-up results of known order, and of those that have none."""

import math

import numpy as np
import pytest

from dem.errors import InputError
from postprocess.statistics.convergence import observed_order

STEPS = np.array([8e-6, 4e-6, 2e-6, 1e-6])


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_pure_power_gives_its_order_and_limit(order, sign):
    values = 3.0 + sign * 0.25 * (STEPS / STEPS[0]) ** order
    found = observed_order(STEPS, values)
    assert found.order == pytest.approx(order, abs=1e-5)
    assert found.limit == pytest.approx(3.0, abs=1e-6)
    assert found.standard_error < 1e-4
    assert found.residual < 1e-6
    assert found.local_orders == pytest.approx([order, order], abs=1e-6)
    assert found.monotone
    # Beyond the steps that were fitted.
    assert found.value(16e-6) == pytest.approx(3.0 + sign * 0.25 * 2**order, abs=1e-4)


def test_first_and_second_order_are_told_apart_in_spite_of_noise():
    noise = 1e-3 * np.random.default_rng(1).standard_normal(8)
    steps = np.geomspace(1.0, 0.1, 8)
    for order, other in ((1, 2), (2, 1)):
        found = observed_order(steps, 1.0 + 0.2 * steps**order + noise * 0.2)
        assert abs(found.order - order) < 3 * found.standard_error < 0.5
        assert abs(found.order - other) > 5 * found.standard_error


def test_a_mixture_lies_between_and_its_local_orders_fall_to_the_lower_one():
    found = observed_order(STEPS, 1.0 + 1e4 * STEPS + 5e9 * STEPS**2)
    assert 1 < found.order < 2
    assert 2 > found.local_orders[0] > found.local_orders[1] > 1


@pytest.mark.parametrize(
    ("steps", "values", "exact", "message"),
    [
        ([1e-5, 2e-5], [1.0, 2.0], None, "an order needs 3 steps or more: got 2"),
        ([1e-5], [1.0], 1.0, "an order needs 2 steps or more: got 1"),
        ([1e-5, 1e-5, 2e-5], [1.0, 1.0, 2.0], None, "step 1e-05 is given twice"),
        ([0.0, 1e-5, 2e-5], [1.0, 1.0, 2.0], None, "every step must be finite and > 0: got 0"),
        ([1e-6, 1e-5, 2e-5], [1.0, math.nan, 2.0], None, "every value must be finite: got nan"),
        ([1e-6, 1e-5, 2e-5], [1.0, 2.0], None, "lists of one length"),
    ],
)
def test_bad_input_is_refused(steps, values, exact, message):
    with pytest.raises(InputError, match=message):
        observed_order(steps, values, exact=exact)
