"""Every bad input is refused with one line: what, where, the value with its unit, the way out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from dem.errors import InputError
from dem.scene.reading import load_scene, parse_scene
from dem.scene.scene import Scene

MakeScene = Callable[..., Scene]
SceneData = Callable[..., dict[str, Any]]

GOOD = "schema_version: 1\nseed: 1\ncount: 10\nphases: [{type: deposit}]\n"

W_IN_MM = (
    "smarticle.middle_length_m: 11.7 means 11.7 m, which no smarticle scene needs; "
    "lengths are in metres: for 11.7 mm write 0.0117"
)
BAD: list[tuple[dict[str, Any], str]] = [
    ({"smarticle.middle_length_m": -0.0117}, "smarticle.middle_length_m: -0.0117 m is out of range; use more than 0 m"),
    ({"smarticle.middle_length_m": 0}, "smarticle.middle_length_m: 0 m is out of range; use more than 0 m"),
    ({"smarticle.thickness_normal_m": 0.0}, "smarticle.thickness_normal_m: 0.0 m is out of range; use more than 0 m"),
    ({"smarticle.thickness_in_plane_m": -1}, "smarticle.thickness_in_plane_m: -1 m is out of range; use more than 0 m"),
    ({"container.radius_m": -0.02}, "container.radius_m: -0.02 m is out of range; use more than 0 m"),
    ({"container.height_m": 0}, "container.height_m: 0 m is out of range; use more than 0 m"),
    (
        {"smarticle.middle_length_m": math.nan},
        "smarticle.middle_length_m: nan is not a finite number; give one in m",
    ),
    ({"container.radius_m": math.inf}, "container.radius_m: inf is not a finite number; give one in m"),
    ({"gravity_m_per_s2": -math.inf}, "gravity_m_per_s2: -inf is not a finite number; give one in m/s²"),
    ({"phases.2.duration_s": math.nan}, "phases.2.duration_s: nan is not a finite number; give one in s"),
    ({"smarticle.aspect_ratio": 2.5}, "smarticle.aspect_ratio: 2.5 is out of range; use at most 2"),
    ({"smarticle.aspect_ratio": -0.1}, "smarticle.aspect_ratio: -0.1 is out of range; use at least 0"),
    (
        {"smarticle.angles_deg": [120, 90]},
        "smarticle.angles_deg: 120° is outside -15° … 105°, the range of the hinges",
    ),
    (
        {"smarticle.thickness_normal_m": 0.008},
        "smarticle: thickness 0.008 m is more than half of middle_length_m = 0.0117 m; "
        "a smarticle is a chain of thin links",
    ),
    ({"smarticle.middle_length_m": 11.7}, W_IN_MM),
    (
        {"container.radius_m": 23.4},
        "container.radius_m: 23.4 means 23.4 m, which no smarticle scene needs; "
        "lengths are in metres: for 23.4 mm write 0.0234",
    ),
    (
        {"smarticle.density_kg_per_m3": 7.85},
        "smarticle.density_kg_per_m3: 7.85 kg/m³ is outside 50 … 25000 kg/m³; "
        "density is in kg/m³: steel is 7850, not 7.85",
    ),
    (
        {"count": 5000, "container.height_m": 0.01},
        "count: 5000 smarticles cannot fit into 0.01 m of container.height_m (half full is 482); "
        "lower the count or leave height_m out",
    ),
    ({"count": 0}, "count: 0 is out of range; use at least 1"),
    ({"count": 2.5}, "count: 2.5 is not a whole number; use e.g. 2"),
    ({"count": "ten"}, "count: got the text 'ten', expected a number; leave out the quotes and the unit"),
    ({"count": None}, "count: null is not a whole number; give one"),
    ({"count": True}, "count: got the boolean true, expected a number"),
    ({"seed": -1}, "seed: -1 is out of range; use at least 0"),
    ({"smarticle.aspect_ratio": True}, "smarticle.aspect_ratio: got the boolean true, expected a number"),
    ({"contact.friction_wall": False}, "contact.friction_wall: got the boolean false, expected a number"),
    (
        {"smarticle.aspect_ratio": "wide"},
        "smarticle.aspect_ratio: got the text 'wide', expected a number; leave out the quotes and the unit",
    ),
    ({"contact.friction_wall": -0.1}, "contact.friction_wall: -0.1 is out of range; use at least 0"),
    ({"contact.restitution": 0}, "contact.restitution: 0 is out of range; use at least 0.01"),
    ({"contact.restitution": 1.5}, "contact.restitution: 1.5 is out of range; use at most 1"),
    ({"phases.2.frequency_hz": 0}, "phases.2.frequency_hz: 0 Hz is out of range; use more than 0 Hz"),
    (
        {"gravity_m_per_s2": 0},
        "gravity_m_per_s2: 0 m/s²; without gravity nothing comes down in phases.0 (deposit)",
    ),
    ({"smarticle.aspect_ration": 0.5}, "smarticle: unknown key 'aspect_ration'; did you mean 'aspect_ratio'?"),
    ({"phases.1.duration": 3}, "phases.1: unknown key 'duration'; did you mean 'duration_s'?"),
    ({"cont": 3}, "unknown key 'cont'; did you mean 'count'?"),
    ({"container.zzz": 3}, "container: unknown key 'zzz'; known keys: radius_m, height_m, tiers"),
    ({"phases.0.settle.timeout": 3}, "phases.0.settle: unknown key 'timeout'; did you mean 'timeout_s'?"),
    (
        {"fricton": 1},
        "unknown key 'fricton'; 'friction_wall' belongs in contact",
    ),
    (
        {"container.height_m": 117.0},
        "container.height_m: 117 means 117 m, which no smarticle scene needs; "
        "lengths are in metres: for 117 mm write 0.117",
    ),
    (
        {"smarticle.angles_deg": [True, 90]},
        "smarticle.angles_deg: got the boolean true, expected a number",
    ),
    (
        {"smarticle.aspect_ratio": "0.5"},
        "smarticle.aspect_ratio: got the text '0.5', expected a number; leave out the quotes and the unit",
    ),
    ({"fidelity": {"base": ["draft"]}}, "fidelity: unknown fidelity ['draft']; known: draft, standard, reference"),
    (
        {"smarticle.aspect_ratio": 2, "smarticle.angles_deg": [105, 105]},
        "smarticle.angles_deg: at 105° and 105° the barbs of l/w = 2 cross; "
        "use angles nearer to 90° or a smaller aspect_ratio",
    ),
    ({"schema_version": 2}, "schema_version: 2 is not known here; this version reads 1"),
    ({"schema_version": "1"}, "schema_version: '1' is not known; use 1"),
    ({"fidelity": "fine"}, "fidelity: unknown fidelity 'fine'; known: draft, standard, reference"),
    ({"fidelity": {"base": "fine"}}, "fidelity: unknown fidelity 'fine'; known: draft, standard, reference"),
    ({"fidelity": {"rows": 9}}, "fidelity.rows: 9 is out of range; use at most 4"),
    (
        {"fidelity": {"rows": 2, "diameter_m": 0.002}},
        "fidelity.rows: 2 rows of 0.002 m do not fit into thickness_normal_m = 0.00127 m; "
        "use one row or a smaller diameter_m",
    ),
    (
        {"fidelity": {"diameter_m": 0.009}},
        "fidelity.diameter_m: spheres of 0.009 m do not fit a middle link of 0.0117 m; "
        "use at most half its length, 0.00585 m",
    ),
    ({"phases": [{"type": "relax"}]}, "phases: got relax; a run starts with one 'deposit' and has no other"),
    (
        {"phases": [{"type": "deposit"}, {"type": "deposit"}]},
        "phases: got deposit, deposit; a run starts with one 'deposit' and has no other",
    ),
    (
        {"phases.1.type": "rest"},
        "phases.1.type: 'rest' is not known; known: 'deposit', 'relax', 'shake', 'actuate', 'shape-change', "
        "'internal-oscillation', 'remove-container', 'pull-hook', 'arrange', 'strain'",
    ),
    (
        {"phases.1": {"duration_s": 1}},
        "phases.1.type: missing in {'duration_s': 1}; write which one it is, see `smarticles schema`",
    ),
    ({"phases.1": "relax"}, "phases.1: 'relax' is not keys and values; write them as {type: …}"),
    ({"smarticle.angles_deg": [90]}, "smarticle.angles_deg.1: missing; it has no default"),
    ({"container": {"tiers": [{"radius_m": 0.03}]}}, "container.tiers.0.height_m: missing; it has no default"),
    (
        {"smarticle.thickness_in_plane_m": 0.5},
        "smarticle: thickness 0.5 m is more than half of middle_length_m = 0.0117 m; "
        "a smarticle is a chain of thin links",
    ),
    (
        {"recording.dissipation_interval_s": 10},
        "recording.dissipation_interval_s: 10 s is longer than series_interval_s = 0.004 s, so that the account of "
        "energies would not close; 2e-4 s is dense enough",
    ),
    ({"motor": {"speed": 6}}, "motor: unknown key 'speed'; did you mean 'speed_limit_rad_per_s'?"),
    (
        {"contact.friction": 0.4},
        "contact: unknown key 'friction'; did you mean 'friction_smarticle' or 'friction_wall'?",
    ),
    (
        {"recording.frame_interval_s": 0.05},
        "recording.frame_interval_s: 0.05 s is not a whole multiple of series_interval_s = 0.004 s; use e.g. 0.048 s",
    ),
    (
        {"recording.frame_interval_s": 0.001},
        "recording.frame_interval_s: 0.001 s is not a whole multiple of series_interval_s = 0.004 s; use e.g. 0.004 s",
    ),
    (
        {"phases.1.duration_s": 0.001},
        "phases.1.duration_s: 0.001 s is shorter than recording.series_interval_s = 0.004 s; "
        "lengthen the phase or sample more often",
    ),
]


@pytest.mark.parametrize(("changes", "expected"), BAD, ids=[next(iter(c)) + f"={list(c.values())}" for c, _ in BAD])
def test_bad_value_is_refused_with_one_line(scene_data: SceneData, changes: dict[str, Any], expected: str) -> None:
    parse_scene(scene_data(), source="bad.yaml")  # good before the change
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data(changes), source="bad.yaml")
    assert str(caught.value) == f"bad.yaml: {expected}"


def test_container_narrower_than_a_smarticle(make_scene: MakeScene, scene_data: SceneData) -> None:
    reach = make_scene().particle.reach
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data({"container.radius_m": 0.005}), source="bad.yaml")
    assert str(caught.value) == (
        f"bad.yaml: container.radius_m: 0.005 m is narrower than a smarticle, whose farthest point is {reach:.4g} m "
        f"from its centre of mass; use at least {reach:.4g} m"
    )
    make_scene({"container.radius_m": 1.01 * reach})


def test_several_errors_show_the_first_and_how_many_more(scene_data: SceneData) -> None:
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data({"seed": -1, "count": 0}), source="bad.yaml")
    assert str(caught.value) == "bad.yaml: seed: -1 is out of range; use at least 0 (and 1 more)"


@pytest.mark.parametrize(("data", "kind"), [([1], "list"), ("text", "str"), (3, "int")], ids=["list", "text", "3"])
def test_file_that_is_no_mapping(data: Any, kind: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_scene(data, source="bad.yaml")
    assert str(caught.value) == f"bad.yaml: a scene is a mapping of keys to values, got {kind}"


def test_missing_key(scene_data: SceneData) -> None:
    data = scene_data()
    del data["seed"]
    with pytest.raises(InputError) as caught:
        parse_scene(data, source="bad.yaml")
    assert str(caught.value) == "bad.yaml: seed: missing; it has no default"


def refused(folder: Path, content: str | bytes, overrides: Sequence[str] = ()) -> str:
    """The message with which a file is refused, the folder cut off."""
    path = folder / "bad.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        load_scene(path, overrides)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message.replace(f"{folder}/", "")


def test_key_given_twice(tmp_path: Path) -> None:
    assert refused(tmp_path, GOOD + "seed: 2\n").startswith("bad.yaml: not valid YAML: key 'seed' is given twice")
    nested = GOOD + "smarticle: {aspect_ratio: 0.4, aspect_ratio: 0.7}\n"
    assert "key 'aspect_ratio' is given twice" in refused(tmp_path, nested)


def test_file_that_is_no_yaml(tmp_path: Path) -> None:
    message = refused(tmp_path, "a: [1\nb")
    assert message.startswith("bad.yaml: not valid YAML: while parsing a flow sequence")
    assert "line 2" in message
    assert "could not determine a constructor" in refused(tmp_path, GOOD + "name: !!python/object:os.system x\n")


def test_binary_file(tmp_path: Path) -> None:
    assert refused(tmp_path, b"\x89HDF\r\n\xff\xfe") == "bad.yaml: is not a text file; give the path of a scene file"
    assert refused(tmp_path, b"a: \x00b").startswith("bad.yaml: not valid YAML: unacceptable character #x0000")


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load_scene(tmp_path / "none.yaml")
    assert str(caught.value) == (
        f"{tmp_path}/none.yaml: cannot be read (No such file or directory); give the path of a scene file"
    )
    with pytest.raises(InputError) as caught:
        load_scene(tmp_path)
    assert str(caught.value) == f"{tmp_path}: cannot be read (Is a directory); give the path of a scene file"


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("seed", "--set seed: write KEY=VALUE, e.g. --set phases.1.duration_s=2"),
        ("=3", "--set =3: write KEY=VALUE, e.g. --set phases.1.duration_s=2"),
        (
            "phases.3.duration_s=1",
            "--set phases.3.duration_s=1: there is no '3' in the scene; lists are numbered from 0",
        ),
        ("count.x=1", "--set count.x=1: there is no 'x' to set; lists are numbered from 0"),
        ("seed=[1", "--set seed=[1: the value is not valid YAML"),
        ("smarticle.w=1", "bad.yaml: smarticle: unknown key 'w'; known keys: "),
        ("gravity_m_per_s2=yes", "bad.yaml: gravity_m_per_s2: got the boolean true, expected a number"),
        ("smarticle.middle_length_m=11.7", f"bad.yaml: {W_IN_MM}"),
        ("contact.friction_wall=.nan", "bad.yaml: contact.friction_wall: nan is not a finite number; give one"),
    ],
)
def test_bad_override(tmp_path: Path, override: str, expected: str) -> None:
    message = refused(tmp_path, GOOD, [override])
    assert message.startswith(expected) if expected.endswith(": ") else message == expected


def test_nested_too_deeply(tmp_path: Path) -> None:
    assert refused(tmp_path, "[" * 5000) == "bad.yaml: not valid YAML: nested too deeply to read"


def test_impossible_date(tmp_path: Path) -> None:
    assert refused(tmp_path, GOOD + "name: 2020-99-99\n") == "bad.yaml: not valid YAML: month must be in 1..12"
    assert refused(tmp_path, GOOD, ["name=2020-99-99"]) == "--set name=2020-99-99: the value is not valid YAML"


@pytest.mark.parametrize("overrides", [[], ["seed=1"]])
def test_empty_file(tmp_path: Path, overrides: list[str]) -> None:
    assert refused(tmp_path, "", overrides) == (
        "bad.yaml: is empty; a scene is a mapping of keys to values, see `smarticles schema`"
    )


@pytest.mark.parametrize("line", ["gravity_m_per_s2: 1:30", "gravity_m_per_s2: 010"])
def test_numbers_that_yaml_1_1_reads_in_base_60_or_8_are_refused(tmp_path: Path, line: str) -> None:
    refused(tmp_path, f"{GOOD}{line}\n")
