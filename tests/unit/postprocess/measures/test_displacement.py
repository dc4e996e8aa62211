"""Mean squared displacements of known motions."""

import numpy as np
import pytest

from dem.errors import InputError
from postprocess import mean_squared_displacement, read_frames


def test_steady_motion_is_ballistic():
    velocity = np.array([[0.1, 0.0, -0.2], [0.0, 0.3, 0.0]])
    times = 0.5 * np.arange(9) + 2.0
    found = mean_squared_displacement(velocity * times[:, None, None], times=times)
    assert found.times_s == pytest.approx(0.5 * np.arange(9))
    assert found.total_m2 == pytest.approx((0.05 + 0.09) / 2 * found.times_s**2)
    assert found.along_m2[4] == pytest.approx(np.array([0.01, 0.09, 0.04]) / 2 * 4.0)
    assert found.count.tolist() == [2 * (9 - lag) for lag in range(9)]
    still = mean_squared_displacement(
        np.tile(velocity[:1] * times[:, None, None], (1, 5, 1)), times, without_drift=True
    )
    assert np.abs(still.total_m2).max() < 1e-20


def test_a_random_walk_grows_with_time_by_the_variance_of_its_steps():
    random = np.random.default_rng(3)
    walk = np.cumsum(random.normal(scale=[0.1, 0.1, 0.2], size=(40, 2000, 3)), axis=0)
    found = mean_squared_displacement(walk, times=np.arange(40.0))
    lags = np.arange(20)
    np.testing.assert_allclose(found.total_m2[lags], 0.06 * lags, rtol=0.06)
    np.testing.assert_allclose(found.along_m2[lags, 2], 0.04 * lags, rtol=0.08)


def test_bodies_that_are_not_poured_yet_do_not_count():
    places = np.zeros((3, 2, 3))
    places[:, 0, 0] = [0, 1, 2]
    places[:, 1] = np.nan
    places[2, 1] = 5.0
    found = mean_squared_displacement(places, times=[0, 1, 2])
    assert found.count.tolist() == [4, 2, 1]
    assert found.total_m2.tolist() == [0, 1, 4]


def test_frames_of_a_run_bring_their_times(make_run):
    run = make_run([(0, 0.0), (1, 0.0), (1, 0.001), (1, 0.003)])
    found = mean_squared_displacement(read_frames(run)[1:])
    assert found.times_s == pytest.approx([0, 0.1, 0.2])
    assert found.total_m2 == pytest.approx([0, (1 + 4) / 2 * 1e-6, 9e-6])


def test_what_is_neither_frames_nor_positions_is_rejected(make_run):
    frames = read_frames(make_run([(0, 0.0), (0, 0.0)]))
    for given in (frames[0], list(frames), "runs/a"):
        with pytest.raises(InputError, match=r"^positions: .* is no array of numbers; give frames of a run"):
            mean_squared_displacement(given)


def test_frames_at_the_nearest_steps_of_taps_are_at_equal_intervals():
    step = 1 / 30 / 501  # of taps at 30 Hz; it does not divide the 0.04 s between frames
    times = step * np.round(0.04 * np.arange(9) / step)
    assert np.ptp(np.diff(times)) > 0.9 * step
    places = np.outer(times, [1.0, 0.0, 0.0])[:, None]
    found = mean_squared_displacement(places, times)
    np.testing.assert_allclose(found.along_m2[1:, 0], found.times_s[1:] ** 2, rtol=4 * step / 0.04)


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([0, 1, 2, 2.5], ["frame 3", "0.5 s", "1 s", "at_intervals"]),
        ([0, 1], ["(4,)"]),
        ([0, 0, 0, 0], ["equal intervals"]),
        ([0, 1, np.nan, 3], ["frame"]),
        (None, ["(4,)"]),
    ],
)
def test_times_without_equal_intervals_are_rejected(times, words):
    with pytest.raises(InputError) as error:
        mean_squared_displacement(np.zeros((4, 1, 3)), times)
    assert all(word in str(error.value) for word in words), error.value
