"""The shipped sweeps: they expand on either engine, and variants differ in what they say alone."""

import ast
import subprocess
import sys
from functools import cache

import pytest
from sweeps import of_one_seed

from dem.phases.shake import Shake
from studies.registry import FOLDER, STUDIES, shipped
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep, on_engine

CODES = ("procedures", "fracture", "strength", "melting", "casting")
RIGID = {"shaft_N_m_per_rad": 3.0, "damping_N_m_s_per_rad": 1.4e-4}  # motors that do not give way
BY_CODE = {"melting": {"title": "melting-main-rigid", **RIGID}, "casting": RIGID}  # values of the code's sweeps alone
LINKS_ALONE = (  # of filaments, and with grips
    "blob-lift", "blob-lift-map", "blob-tangle", "blob-tangle-loops", "blob-topple", "blob-topple-map", "staples-grips",
)  # fmt: skip
AGAIN = {"gravish": 9, "melting": 8}


@cache
def points_of(name: str, *, quick: bool = False) -> list[Point]:
    """Points of a study, expanded once for all tests of this file."""
    return expand(load_sweep(shipped(name).sweep_file(quick=quick)))


def first_seed(name: str) -> list[Point]:
    """Points of a study with the first of its seeds."""
    return expand(of_one_seed(load_sweep(shipped(name).sweep_file())))


@pytest.mark.parametrize("name", sorted(AGAIN))
def test_some_points_come_again_on_yade_from_the_same_poses(name: str) -> None:
    found = points_of(name)
    again = [point for point in found if point.again]
    assert again == found[-len(again) :]
    assert len(again) == AGAIN[name]
    for point in again:
        assert point.scene.engine == "yade"
        twin = next(p for p in found if p.name == point.name.replace("yade", "links"))
        # A name means knobs of its own on each engine; all else is the same, and so are seed and pour.
        assert twin.scene.fidelity.base == point.scene.fidelity.base
        assert twin.scene.model_copy(update={"engine": "yade", "fidelity": point.scene.fidelity}) == point.scene
        assert twin.scene.seed_for("poses") == point.scene.seed_for("poses")


@pytest.mark.parametrize(
    ("engine", "name"),
    [
        *(("yade", name) for name in sorted(set(STUDIES) - {"engines", "chain-bodies", *LINKS_ALONE})),
        *(("links", name) for name in sorted(set(STUDIES) - {"engines", "chain-bodies"})),
    ],
)
def test_every_study_runs_on_either_engine(name: str, engine: str) -> None:
    found = expand(on_engine(of_one_seed(load_sweep(shipped(name).sweep_file())), engine))
    assert {point.scene.engine for point in found} == {engine}
    assert not any(point.again for point in found)


@pytest.mark.parametrize("name", CODES)
def test_a_study_by_the_papers_code_differs_in_protocol_and_motors(name: str) -> None:
    """Point by point, in the same order."""
    text, code = first_seed(name), first_seed(f"{name}-code")
    assert len(text) == len(code) > 0
    for one, other in zip(text, code, strict=True):
        assert one.name == other.name
        assert {**one.values, "protocol": "code", "title": f"{name}-code", **BY_CODE.get(name, {})} == other.values
        assert (one.scene.motor.law, other.scene.motor.law) == ("halt", "ease")
        assert (one.scene.contact.friction_smarticle, other.scene.contact.friction_smarticle) == (0.4, 0.2)
        for phase, twin in zip(one.scene.phases, other.scene.phases, strict=True):
            if isinstance(phase, Shake) and isinstance(twin, Shake):
                assert (phase.moves, twin.moves) == ("container", "floor")
            else:
                assert phase == twin
        assert one.scene.seed_for("poses") == other.scene.seed_for("poses")


def test_help_has_the_first_paragraph_of_each_script() -> None:
    scripts = [study for study in STUDIES.values() if not study.variants]
    for study in scripts:
        docstring = ast.get_docstring(ast.parse((FOLDER / f"{study.module}.py").read_text(encoding="utf-8")))
        assert docstring
        assert study.about == docstring.split("\n\n")[0]


def test_the_registry_of_studies_loads_nothing_large() -> None:
    code = "import sys, studies.registry; print(*{name.split('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "studies" in loaded
    assert not {"pandas", "matplotlib", "numpy", "pyvista", "yade"} & set(loaded)
