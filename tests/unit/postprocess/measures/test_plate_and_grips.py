"""What is read off compressions, tensions and pick-ups, on curves that are known."""

import math
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dem.record.series import Series
from postprocess.measures import grips, plate

AREA, STEP, SPEED = math.pi * 0.01**2, 0.002, 0.01
MASS, GRAVITY, COUNT = 1e-4, 10.0, 20


def read(phase: dict[str, Any], **columns: Any) -> tuple[Any, Series]:
    """Return a run with one phase at rest and one given, and a series with samples of the second one."""
    n = len(next(iter(columns.values())))
    times = STEP * np.arange(1, n + 1)
    data = {"time_s": times, "phase": np.ones(n, dtype=np.int64), "container_z_m": np.zeros(n), **columns}
    series = Series(
        path=Path("series.h5"), data=MappingProxyType(data), units={}, descriptions={}, scene_sha256="", seed=1
    )
    entry = SimpleNamespace(start_s=0.0, end_s=float(times[-1]))
    run = SimpleNamespace(
        scene={"container": {"radius_m": 0.01}, "phases": [{}, phase], "gravity_m_per_s2": GRAVITY},
        phases=[entry, entry],
        manifest=SimpleNamespace(smarticle_mass_kg=MASS, count=COUNT),
    )
    return run, series


def values(measure: Any, run: Any, series: Series) -> dict[str, float]:
    assert measure.available_for(series, 1)
    return dict(zip((each.label for each in measure.quantities), measure.take(run, series, 1), strict=True))


def test_a_compression_with_an_elastic_unloading() -> None:
    # Down by 2 mm of 20 mm, back by 1 mm. Loading at 10 kPa, unloading at 50 kPa from the peak of 1 kPa.
    ways = np.concatenate([np.arange(1, 101), 100 - np.arange(1, 51)]) * STEP * SPEED
    strains = ways / 0.02
    middle = strains - 0.5 * np.diff(strains, prepend=0.0)
    stresses = np.where(np.arange(150) < 100, 1e4 * middle, np.maximum(0, 1e3 - 5e4 * (0.1 - middle)))
    forces = np.column_stack([np.zeros((150, 2)), AREA * stresses])
    heights = 0.02 - ways
    heights[-1] = math.nan  # removed
    run, series = read({"speed_m_per_s": SPEED}, plate_force_N=forces, plate_z_m=heights)
    found = values(plate.MEASURES[0], run, series)
    assert found["plate peak stress"] == pytest.approx(1e3, rel=0.01)
    assert found["strain at the peak stress"] == found["largest strain"] == pytest.approx(0.1)
    assert found["unloading modulus"] == pytest.approx(5e4, rel=1e-3)
    returned = 0.5 * 1e3**2 / 5e4
    assert found["plate work"] == pytest.approx(AREA * 0.02 * (0.5 * 1e3 * 0.1 - returned), rel=0.01)


def test_without_unloading_there_is_no_modulus_of_it() -> None:
    forces = np.column_stack([np.zeros((50, 2)), np.linspace(0, 1, 50)])
    run, series = read({"speed_m_per_s": SPEED}, plate_force_N=forces, plate_z_m=0.02 - SPEED * STEP * np.arange(1, 51))
    assert math.isnan(values(plate.MEASURES[0], run, series)["unloading modulus"])
    assert not plate.has_plate(series, 0)


@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("held_fast", [False, True])
def test_a_tension_with_a_plateau(axis: str, held_fast: bool) -> None:
    # 200 samples, 4 mm: no force up to 1 mm, 0.01 N up to 3 mm, then nothing.
    elongations = STEP * SPEED * np.arange(1, 201)
    pulls = np.where((elongations > 0.001) & (elongations < 0.003), 0.01, 0.0)
    pulls[20] = 0.05  # a single sample, which is no peak
    moved, fixed = np.zeros((200, 3)), np.zeros((200, 3))
    moved[:, "xyz".index(axis)], fixed[:, "xyz".index(axis)] = -pulls, 0.5 * pulls
    moved[0] = fixed[0] = math.nan  # no sample before
    asked = {"axis": axis, "force_limit_N": 0.01, "distance_m": 0.005 if held_fast else 0.004}
    run, series = read(
        asked,
        grip_moved_force_N=moved,
        grip_fixed_force_N=fixed,
        elongation_m=elongations,
        grip_distance_m=0.01 + elongations,
    )
    found = values(grips.MEASURES[0], run, series)
    whole = COUNT * MASS * GRAVITY
    assert found["peak pull over n W_s"] == pytest.approx(0.01 / whole)
    assert found["pull on the resting grip at the peak over n W_s"] == pytest.approx(0.005 / whole)
    assert 0.1 < found["strain at the peak pull"] < 0.3
    assert found["work of the pull"] == pytest.approx(0.01 * 0.002 + 0.05 * STEP * SPEED, rel=0.02)
    assert found["pull held fast"] == held_fast


def test_what_hangs_on_a_grip_is_picked_up() -> None:
    n = 150
    hanging = np.where(np.arange(n) < 75, 12, 5)  # some fall off
    forces = np.column_stack([np.zeros((n, 2)), -hanging * MASS * GRAVITY])
    elongations = np.full(n, 0.01)
    elongations[:10] = math.nan  # before
    run, series = read({}, grip_moved_force_N=forces, grip_moved_count=np.full(n, 3), elongation_m=elongations)
    assert values(grips.MEASURES[1], run, series) == pytest.approx(
        {"gripped": 3.0, "gripped mass": 3 * MASS, "picked up": 8.0, "picked up mass": 8 * MASS}
    )
    # Three light ones of a mixture: their own weight is recorded.
    light = np.full(n, 0.5 * MASS * GRAVITY)
    run, series = read(
        {},
        grip_moved_force_N=forces,
        grip_moved_count=np.full(n, 3),
        grip_moved_weight_N=light,
        elongation_m=elongations,
    )
    assert values(grips.MEASURES[1], run, series) == pytest.approx(
        {"gripped": 3.0, "gripped mass": 0.5 * MASS, "picked up": 5.5, "picked up mass": 5.5 * MASS}
    )
    assert not grips.has_grips(series, 0)
