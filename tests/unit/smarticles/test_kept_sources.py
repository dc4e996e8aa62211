"""The source code on which kept tables depend."""

from pathlib import Path

import pytest

from postprocess.measures import registry
from smarticles import kept_tables


def top_m(frame: object, run: object) -> float:
    return 0.0


def test_tables_depend_on_the_source_of_a_function_that_another_package_measures_by(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert Path(__file__) not in set(kept_tables._sources())
    known = registry.registered()
    monkeypatch.setattr(registry, "registered", lambda: (*known, registry.measure_of(top_m)))
    assert Path(__file__) in set(kept_tables._sources())
