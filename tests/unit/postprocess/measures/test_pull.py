"""Measures of a pulled hook, from histories of force with known answers."""

import math

import h5py
import numpy as np
import pytest
from synthetic import SyntheticRun
from synthetic.hooked import AFTER_REST, INTERVAL, SPEED, write_hooked_run

from dem.errors import InputError
from dem.record.run import Run, open_run
from dem.record.series import read_series
from postprocess.measures.pull import FREE, WINDOW, freed, held_fast, lost_after, moving_mean, peak, read_pull
from postprocess.measures.table import summarise_run

HEIGHT, APEX, BASE = 0.02, 0.6, 0.5  # N; s; s to either side
DURATION, DISTANCE = 2.0, 2.0 * SPEED


def triangle(time):
    """Up to `HEIGHT` at `APEX` and down again, zero beyond `BASE` to either side."""
    return HEIGHT * np.clip(1 - np.abs(time - APEX) / BASE, 0, None)


def synthetic(**changes):
    return SyntheticRun(phases=AFTER_REST, packing=(0.1, 0.1, 0.1), frames_per_phase=2, **changes)


@pytest.fixture
def pulled(tmp_path):
    """Makes a run and gives its pull."""

    def make(force):
        directory = write_hooked_run(tmp_path / "run", synthetic(), force)
        return read_pull(open_run(directory), read_series(directory), 2)

    return make


def test_a_triangle_has_its_peak_and_its_area(pulled):
    pull = pulled(triangle)
    highest = peak(pull)
    # The mean over a window about the tip of a triangle is lower than the tip by a quarter of what it loses in one.
    assert highest.force == pytest.approx(HEIGHT * (1 - WINDOW / BASE / 4), rel=1e-6)
    assert highest.time == pytest.approx(APEX, abs=INTERVAL)
    assert highest.raised == pytest.approx(APEX * SPEED, abs=INTERVAL * SPEED)
    # The midpoint rule is exact but for the three kinks.
    assert pull.work == pytest.approx(HEIGHT * BASE * SPEED, rel=1e-4)
    assert pull.raised[[0, -1]] == pytest.approx([0, DISTANCE])


@pytest.mark.parametrize(
    ("after", "share"),
    [
        (np.ones_like, 0.0),
        (lambda since: np.clip(1 - since / 0.5, 0, None), 0.5),
        (lambda since: np.clip(1 - since / 0.25, 0, None), 0.75),
        (lambda since: np.where(since < 0, 1.0, 0.0), 1.0),
    ],
)
def test_the_share_of_the_peak_that_is_lost_is_one_less_the_mean_force_beyond_it(pulled, after, share):
    pull = pulled(lambda time: HEIGHT * np.where(time < APEX, time / APEX, after(time - APEX)))
    highest = peak(pull)
    # The mean over the window is lower than a sharp peak, and lies before one that breaks off.
    assert lost_after(pull, highest, 0.5 * SPEED) == pytest.approx(share, abs=0.06)
    assert math.isnan(lost_after(pull, highest, DISTANCE))


def test_the_work_of_a_constant_force_is_force_times_distance(pulled):
    pull = pulled(lambda time: np.full_like(time, HEIGHT))
    assert pull.work == pytest.approx(HEIGHT * DISTANCE, rel=1e-9)
    assert pull.engine_work == pytest.approx(pull.work, rel=1e-9)
    assert pull.left == pytest.approx(HEIGHT)
    assert math.isnan(freed(pull))


def test_a_single_sample_does_not_make_a_peak(pulled):
    """One contact for one sample, five times as strong: half of the peak is left of it in a window of ten samples."""
    spike, middle = 5 * HEIGHT, 1.5 - INTERVAL / 2
    pull = pulled(lambda time: np.where(np.abs(time - middle) < INTERVAL / 2, spike, triangle(time)))
    assert pull.force.max() == pytest.approx(spike)
    assert peak(pull, window=INTERVAL).time == pytest.approx(middle)
    highest = peak(pull)
    assert highest.force == pytest.approx(HEIGHT * (1 - WINDOW / BASE / 4), rel=1e-6)
    assert highest.time == pytest.approx(APEX, abs=INTERVAL)


@pytest.mark.parametrize("window", [INTERVAL, WINDOW, 4 * WINDOW, 10.0])
def test_means_over_windows_stand_at_their_middles(pulled, window):
    pull = pulled(lambda time: HEIGHT * time)
    times, means = moving_mean(pull, window)
    assert means == pytest.approx(HEIGHT * times)
    assert len(means) == len(pull.force) - min(round(window / INTERVAL), len(pull.force)) + 1


def test_a_hook_is_free_when_its_force_is_gone_for_good(pulled):
    pull = pulled(triangle)
    # The flank falls below the threshold at this time; the window's mean follows it but for its rounding at the foot.
    fallen = APEX + BASE * (1 - FREE * (1 - WINDOW / BASE / 4))
    assert freed(pull) == pytest.approx(fallen, abs=2 * INTERVAL)
    assert pull.left == pytest.approx(0, abs=1e-12)


def test_a_pull_that_has_just_begun_is_not_measured(tmp_path):
    directory = write_hooked_run(tmp_path / "run", synthetic(), triangle)
    with h5py.File(directory / "series.h5", "r+") as file:
        until = int((file["phase"][()] < 2).sum()) + 1
        for name in list(file):
            values, attributes = file[name][()][:until], dict(file[name].attrs)
            del file[name]
            file[name] = values
            file[name].attrs.update(attributes)
    with pytest.raises(InputError, match=r"series\.h5: no force of a hook throughout phase 2 of"):
        read_pull(open_run(directory), read_series(directory), 2)
    assert "hook work [J]" not in summarise_run(Run(directory)).columns


def test_what_is_left_on_a_hook_is_a_number_and_a_mass(tmp_path):
    run = Run(write_hooked_run(tmp_path / "run", synthetic(), lambda time: HEIGHT + 0 * time))
    row = summarise_run(run, costly="never").iloc[-1]
    weight = row["hook load mass at the end [kg]"] * run.scene["gravity_m_per_s2"]
    assert weight == pytest.approx(HEIGHT, rel=1e-6)
    assert row["hook load mass at the end [kg]"] == pytest.approx(
        row["hook load at the end [smarticles]"] * run.manifest.smarticle_mass_kg
    )


def test_only_a_force_limit_stops_a_hook_on_the_way(pulled):
    pull, farther = pulled(triangle), {"distance_m": 1.02 * DISTANCE}
    assert held_fast(pull.raised, {**farther, "force_limit_N": HEIGHT})
    # Without a limit the last sample lies before the arrival because samples are rare.
    assert not held_fast(pull.raised, farther)
    assert not held_fast(pull.raised, {**farther, "force_limit_N": None})


def test_the_error_of_the_ledger_is_that_of_the_pull_alone(tmp_path):
    directory = write_hooked_run(tmp_path / "run", synthetic(), triangle)
    without = read_pull(open_run(directory), read_series(directory), 2)
    assert math.isnan(without.residual)
    with h5py.File(directory / "series.h5", "r+") as file:
        pulling = file["phase"][()] == 2
        # Before the pull the ledger had missed half of what was dissipated; within it, 2 %.
        file["energy_residual_J"] = np.where(pulling, 1.0 + 0.02 * np.cumsum(pulling), 1.0)
        file["dissipated_energy_J"] = np.where(pulling, 2.0 + np.cumsum(pulling), 2.0)
        for name in ("energy_residual_J", "dissipated_energy_J"):
            file[name].attrs.update(file["container_work_J"].attrs)
    assert read_pull(open_run(directory), read_series(directory), 2).residual == pytest.approx(0.02)
