"""The double is an engine, and falls as it says; types are checked by `mypy tests/double.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from double import EngineDouble, KindDouble
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.engine import interface
from dem.engine.kinds import EngineKind, engine_kind
from dem.errors import InputError, RunError


def falling(*heights: float) -> EngineDouble:
    engine = EngineDouble.of(small(), 1e-4)
    engine.add(Poses(np.array([[0.0, 0.0, height] for height in heights]), (Rotation.identity(),) * len(heights)))
    return engine


def test_it_has_all_that_an_engine_has() -> None:
    engine = falling(0.1)
    parts = {"Fixtures": engine.fixtures, "Motors": engine.motors, "Strings": engine.strings, "Account": engine.account}
    for name, part in {**parts, "Engine": engine}.items():
        wanted = {key for key in vars(getattr(interface, name)) if not key.startswith("_")}
        assert wanted <= set(dir(part)), name
        assert len(wanted) >= 5
    assert {key for key in vars(EngineKind) if not key.startswith("_")} <= set(dir(KindDouble()))


def test_it_falls_stands_and_goes_on_from_what_it_saved(tmp_path: Path) -> None:
    engine = falling(0.05, 0.1)
    engine.advance(500)
    assert engine.positions[:, 2] == pytest.approx(np.array([0.05, 0.1]) - 9.81 * 0.05**2 / 2)
    assert (engine.touches().tolist(), engine.unbalanced_force()) == ([0, 0], 1.0)
    saved, other = engine.save(tmp_path), EngineDouble.of(small(), 1e-4)
    other.load(saved, tmp_path)
    for each in (engine, other):
        each.advance(1500)
    assert np.array_equal(engine.positions, other.positions)
    assert engine.positions[:, 2] == pytest.approx(engine.stands)
    spheres = engine.state().spheres(engine.particle)
    assert spheres[..., 2].min() == pytest.approx(engine.particle.radius)
    assert (other.steps, other.time, other.account) == (engine.steps, engine.time, engine.account)


def test_it_stops_when_it_is_to() -> None:
    engine = falling(0.1)
    engine.stops_at = 5
    with pytest.raises(RunError, match="stopped at step 5 of 7"):
        engine.advance(7)


def test_an_engine_that_is_not_there_is_refused_with_those_that_are() -> None:
    assert engine_kind("yade").name == "yade"
    with pytest.raises(InputError, match=r"^engine: 'abacus' .* use yade"):
        engine_kind("abacus")
