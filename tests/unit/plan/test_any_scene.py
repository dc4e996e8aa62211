"""Whatever a scene file says, reading and planning it ends within a second: in a plan, or in one clear line.

Scenes are the shipped ones with any value in any place, keys dropped, added and nested. `ANY_SCENES=20000 pytest
tests/unit/plan/test_any_scene.py` tries so many of each kind instead of a few hundred.
"""

import gc
import json
import math
import os
import resource
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import CHAIN, SMALL, changed, small

from dem.errors import InputError
from dem.plan.outlook import plan
from dem.scene.reading import json_schema
from smarticles.commands.run import read_scene
from validation.fuzz import places, scaled, shipped_scenes, value_at

# As many as 20 s are enough for on a busy machine; 0.01 s each, and what hypothesis itself takes.
TRIED = int(os.environ.get("ANY_SCENES", "200"))
MOST_S = 1.0  # of processor time
MOST_BYTES = 2**30
MOST_CHARACTERS = 1500  # of a line; three errors with long lists of choices have 1000
ENOUGH = settings(
    max_examples=TRIED,
    derandomize="ANY_SCENES" not in os.environ,
    suppress_health_check=list(HealthCheck),
    database=None,
)


def shipped() -> list[dict[str, Any]]:
    """Scenes of sweeps, starters and pages, and small ones that leave most keys out."""
    sine = {"type": "sine", "centre_deg": 90, "amplitude_deg": 5, "frequency_hz": 3}
    ramp = {"type": "ramp", "to_deg": 0, "duration_s": 0.5}
    swings = {"type": "sequence", "steps": [ramp, {"type": "return", "duration_s": 0.5}], "repeat": 3}
    both = {"type": "actuate", "barb_1": sine, "barb_2": swings, "duration_s": 2}
    tiers = [{"radius_m": 0.0234, "height_m": 0.05}, {"radius_m": 0.02, "height_m": 0.1}]
    return [
        *shipped_scenes(),
        *(SMALL, CHAIN),
        changed(SMALL, {"phases.1": both, "phases.2": {"type": "internal-oscillation", "theta_deg": 10}}),
        changed(SMALL, {"hooks": {}, "phases.2": {"type": "pull-hook"}}),
        changed(SMALL, {"container": {"tiers": tiers}, "phases.2": {"type": "remove-container"}, "engine": "links"}),
    ]


SCHEMA = json_schema()
NUMBERS = st.one_of(
    st.sampled_from([0, -0.0, 1, -1, 5e-324, 1e-300, 1e-30, 1e-9, 1e9, 1e30, 1e300, 1.7e308, -1e300, 10**30, 10**400]),
    st.sampled_from([math.nan, math.inf, -math.inf, 2**31, 2**53 + 1, 2**63, 2**64]),
    st.floats(),
    st.integers(),
    st.integers(-320, 308).map(lambda power: float(f"1e{power}")),
)
TEXTS = st.one_of(
    st.sampled_from(
        ["", " ", "0.4", "1 s", "1e3", "0,5", "true", "null", "yade", "deposit", "draft", "\n", "a\nb", "\x00"]
    ),
    st.sampled_from(["{{ 7 * 7 }}", "$(reboot)", "'; rm -rf / #", "../../etc/passwd", "<script>", "%s%n", "☃" * 200]),
    st.sampled_from(["\ud800", "\u2028", "\x85", "\u202e", "x" * 2000]),
    st.text(max_size=20),
)
ATOMS = st.one_of(st.none(), st.booleans(), NUMBERS, TEXTS, st.dates())
ANYTHING = st.recursive(
    ATOMS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.one_of(TEXTS, NUMBERS), inner, max_size=3),
    max_leaves=8,
)


KEYS = sorted({key for part in [SCHEMA, *SCHEMA["$defs"].values()] for key in part.get("properties", {})})


@st.composite
def broken(draw: st.DrawFn) -> Any:
    """A shipped scene with one to three things done to it."""
    data = deepcopy(draw(st.sampled_from(SHIPPED) | st.sampled_from(SHAPED)))
    for _ in range(draw(st.integers(1, 3))):
        found = list(places(data))
        if not found:
            return data
        *above, last = draw(st.sampled_from(found))
        parent = value_at(data, tuple(above))
        what = draw(st.sampled_from(["put", "put", "scale", "scale", "drop", "add", "nest", "twice", "of another"]))
        value = parent[last]
        if what == "drop":
            del parent[last]
        elif what == "scale" and isinstance(value, int | float) and not isinstance(value, bool):
            factor = draw(
                st.sampled_from([-1.0, 0.5, 0.999, 1.001, 2.0]) | st.integers(-320, 308).map(lambda p: 10.0**p)
            )
            parent[last] = scaled(value, factor)
        elif what == "add" and isinstance(parent, dict):
            parent[draw(st.sampled_from(KEYS) | TEXTS)] = draw(ANYTHING)
        elif what == "nest":
            parent[last] = draw(st.sampled_from([[value], {last: value}, [value, value], {"type": value}]))
        elif what == "twice" and isinstance(parent, list):
            parent.append(deepcopy(value))
        elif what == "of another":
            other = draw(st.sampled_from(SHIPPED))
            parent[last] = deepcopy(value_at(other, draw(st.sampled_from(list(places(other))))))
        else:
            parent[last] = draw(ANYTHING)
    return data


SHIPPED = shipped()
SHAPED = [scene for scene in SHIPPED if scene.get("particle")]


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Stops what takes more processor time or memory: a search that never ends must not hold up the tests."""

    def late(*_: object) -> None:
        msg = f"still at it after {seconds:g} s of processor time"
        raise TimeoutError(msg)

    before = signal.signal(signal.SIGVTALRM, late)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MOST_BYTES, limits[1]))
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def read_and_plan(content: str, folder: Path) -> str | None:
    """The line with which a scene is rejected; None where it is planned."""
    file = folder / "scene.yaml"
    file.write_text(content, encoding="utf-8")
    # Collecting what thousands of scenes before have left takes a second, and is not what this one costs.
    gc.disable()
    begun = time.process_time()
    try:
        with at_most(5 * MOST_S):
            planned = plan(read_scene(file, []))
            text = planned.to_text()
            json.dumps(asdict(planned), allow_nan=False)
    except InputError as error:
        line = str(error)
        assert len(line.splitlines()) == 1, line
        assert line.startswith(str(file)), line
        assert len(line) <= MOST_CHARACTERS, line
        return line
    finally:
        took = time.process_time() - begun
        gc.enable()
        assert took <= MOST_S, f"took {took:.2f} s"
    assert not {"nan", "inf"} & set(text.replace(",", " ").split()), text
    return None


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    for engine in ("yade", "links"):  # what they import is not what a scene costs
        plan(small({"engine": engine, "phases.2": {"type": "internal-oscillation", "theta_deg": 10}}))
    return tmp_path_factory.mktemp("scenes")


def as_yaml(data: Any) -> str:
    """The data as a file; text that YAML cannot hold is left out."""
    try:
        return str(yaml.safe_dump(data, allow_unicode=True, sort_keys=False)).encode("utf-8", "replace").decode()
    except yaml.YAMLError:
        return "phases: 3"


def numbers(node: Any, place: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every number of the schema with its place."""
    if isinstance(node, dict):
        if node.get("type") in ("number", "integer"):
            yield place, node
        for key, value in node.items():
            yield from numbers(value, f"{place}.{key}")
    elif isinstance(node, list):
        for index, value in enumerate(node):
            yield from numbers(value, f"{place}.{index}")


def test_every_number_states_its_range() -> None:
    found = {
        place: node
        for place, node in numbers(SCHEMA)
        if not {"const", "enum"} & node.keys() and "prefixItems" not in place
    }
    assert len(found) > 60
    low, high = {"minimum", "exclusiveMinimum"}, {"maximum", "exclusiveMaximum"}
    assert [place for place, node in found.items() if not (low & node.keys() and high & node.keys())] == []


def test_shipped_scenes_are_planned(folder: Path) -> None:
    assert len(SHIPPED) > 20
    for data in SHIPPED:
        assert read_and_plan(as_yaml(data), folder) is None


@ENOUGH
@given(data=broken())
def test_shipped_scenes_with_anything_done_to_them(data: Any, folder: Path) -> None:
    read_and_plan(as_yaml(data), folder)


@ENOUGH
@given(text=st.sampled_from(SHIPPED).map(as_yaml), at=st.integers(0, 3000), inserted=TEXTS, cut=st.integers(0, 200))
def test_files_cut_and_filled_anywhere(text: str, at: int, inserted: str, cut: int, folder: Path) -> None:
    inserted = inserted.encode("utf-8", "replace").decode()
    read_and_plan(text[:at] + inserted + text[at + cut :], folder)
