"""Sweeps as labelled arrays, with a dimension for each variable."""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import smarticles
from smarticles.labelled import dataset_of
from smarticles.public import write_sweep
from smarticles.sweeps import make_folder

with_xarray = pytest.mark.skipif(importlib.util.find_spec("xarray") is None, reason="xarray is not installed")
PHI = "phi [-]"


def table_of(count: int) -> pd.DataFrame:
    return pd.DataFrame({"run": [f"r{k}" for k in range(count)], "seed": 1, PHI: [0.1 * k for k in range(count)]})


@with_xarray
def test_a_grid_has_a_dimension_for_each_variable_and_nan_where_a_run_is_missing() -> None:
    values: list[dict[str, Any]] = [
        {"ratio": ratio, "seed": seed, "law": "a"} for ratio in (0.4, 0.7) for seed in (1, 2, 3)
    ]
    found = dataset_of(table_of(5).assign(state=["done"] * 4 + ["running"]), values[:5])
    assert found.where(found["state"] == "done")[PHI].count() == 4
    assert dict(found.sizes) == {"ratio": 2, "seed": 3}
    assert found[PHI].sel(ratio=0.7, seed=2) == pytest.approx(0.4)
    assert found[PHI].sel(ratio=0.7, seed=3).isnull()
    assert found[PHI].attrs["units"] == "-"
    assert found["run"].sel(ratio=0.4, seed=3) == "r2"
    assert found[PHI].mean("seed").sel(ratio=0.4) == pytest.approx(0.1)


@with_xarray
def test_a_variable_that_is_paired_with_another_one_is_a_coordinate_along_it() -> None:
    values = [{"count": n, "radius": [n], "seed": s} for n in (10, 20) for s in (1, 2)]
    found = dataset_of(table_of(4), values)
    assert dict(found.sizes) == {"count": 2, "seed": 2}
    assert found["radius"].dims == ("count",)
    assert found["radius"].values.tolist() == ["[10]", "[20]"]


@with_xarray
def test_a_coarser_variable_before_a_finer_one_does_not_lead() -> None:
    values = [{"kind": kind, "length": length} for kind, length in (("short", 1), ("short", 2), ("long", 3))]
    found = dataset_of(table_of(3), values)
    assert dict(found.sizes) == {"length": 3}
    assert found["kind"].values.tolist() == ["short", "short", "long"]


@with_xarray
@pytest.mark.parametrize("values", [[{"x": 1}, {"x": 1}], [{"x": 1}, {"x": 1}, {"x": 2}], [{}, {}]])
def test_runs_with_equal_values_are_along_the_dimension_of_runs(values: list[dict[str, int]]) -> None:
    found = dataset_of(table_of(len(values)), values)
    assert dict(found.sizes) == {"run": len(values)}
    assert found[PHI].sel(run="r1") == pytest.approx(0.1)


@with_xarray
def test_a_sweep_becomes_a_dataset_of_its_last_or_a_named_phase(swept: smarticles.SweepDirectory) -> None:
    phi = "phi second-highest-com [-]"
    shaken = swept.to_xarray(phase="shake")
    assert dict(shaken.sizes) == {"aspect_ratio": 2, "seed": 2}
    assert shaken[phi].sel(aspect_ratio=0.7, seed=1) == pytest.approx(0.2 * 1.002)
    assert swept.to_xarray()[phi].values == pytest.approx(0.1 * 1.002)
    with pytest.raises(smarticles.InputError, match="no run has a phase 'shak'"):
        swept.to_xarray(phase="shak")


@with_xarray
def test_named_values_keep_the_order_of_the_sweep_in_a_dataset() -> None:
    values = [{"friction": name, "seed": seed} for name in ("low", "high", "gone") for seed in (2, 1)]
    found = dataset_of(table_of(6), values)
    assert found["friction"].values.tolist() == ["low", "high", "gone"]
    assert found["seed"].values.tolist() == [1, 2]
    assert found[PHI].sel(friction="high", seed=1) == pytest.approx(0.3)
    assert found["run"].sel(friction="gone", seed=2) == "r4"


@with_xarray
@pytest.mark.parametrize("wrong", [9, -1, 1.5, True, None])
def test_a_dataset_is_of_the_phase_with_a_number(swept: smarticles.SweepDirectory, wrong: Any) -> None:
    phi = "phi second-highest-com [-]"
    assert swept.to_xarray(phase=2)[phi].sel(aspect_ratio=0.7, seed=1) == pytest.approx(0.2 * 1.002)
    with pytest.raises(smarticles.InputError, match=r"^phase: no run has begun phase .*; known: 0, 1, 2, 3$"):
        swept.to_xarray(phase=wrong)


def test_without_xarray_the_message_says_how_to_get_it(
    swept: smarticles.SweepDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(smarticles.InputError, match=r"pip install .smarticles\[arrays\]"):
        swept.to_xarray()


@pytest.fixture
def swept(tmp_path: Path, write_run: Any) -> smarticles.SweepDirectory:
    """Two aspect ratios, two seeds each; φ in the shaken phase 0.12, 0.14, 0.2 and 0.3."""
    scene = smarticles.Scene(seed=1, count=5, phases=[{"type": "deposit"}])
    file = write_sweep(scene, {"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2]}, tmp_path)
    folder = make_folder(file, tmp_path / "out", "test")
    for entry, packing in zip(folder.entries, (0.12, 0.14, 0.2, 0.3), strict=True):
        known = {"aspect_ratio": entry.values["aspect_ratio"], "seed": entry.values["seed"], "frames_per_phase": 1}
        write_run(folder.run(entry), packing=(0.1, 0.1, packing, 0.1), **known)
    return smarticles.read_sweep(tmp_path / "out")
