"""Examples in docstrings of dem say what is so."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import dem


def test_examples_in_docstrings_are_true() -> None:
    names = [module.name for module in pkgutil.walk_packages(dem.__path__, "dem.")]
    results = [doctest.testmod(importlib.import_module(name), raise_on_error=False) for name in names]
    assert len(names) > 50
    assert sum(result.failed for result in results) == 0
    assert sum(result.attempted for result in results) > 0
