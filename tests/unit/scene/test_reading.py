"""Files and overrides that are no scene, and errors; see `test_bad_scenes.py`."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from dem.errors import InputError
from dem.scene.reading import load_scene, parse_scene

SceneData = Callable[..., dict[str, Any]]

GOOD = "schema_version: 1\nseed: 1\ncount: 10\nphases: [{type: deposit}]\n"

W_IN_MM = (
    "smarticle.middle_length_m: 11.7 means 11.7 m, which no smarticle scene needs; "
    "lengths are in metres: for 11.7 mm write 0.0117"
)


def test_several_errors_are_reported_together(scene_data: SceneData) -> None:
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data({"seed": -1, "count": 0}), source="bad.yaml")
    both = "seed: -1 is out of range; use at least 0; also count: 0 is out of range; use at least 1"
    assert str(caught.value) == f"bad.yaml: {both}"
    with pytest.raises(InputError) as caught:
        parse_scene(
            scene_data({"seed": -1, "count": 0, "name": 5, "gravity_m_per_s2": -1, "engine": "abacus"}),
            source="bad.yaml",
        )
    assert str(caught.value).endswith("; also seed: -1 is out of range; use at least 0 (and 2 more)")
    assert str(caught.value).count("; also ") == 2


@pytest.mark.parametrize(
    ("changes", "stated"),
    [
        ({"engine": "yad"}, "engine: 'yad' is not known; did you mean 'yade'?"),
        ({"fidelity": "standart"}, "fidelity: unknown fidelity 'standart'; did you mean 'standard'?"),
        ({"phases.1.type": "tap"}, "phases.1.type: 'tap' is not known; did you mean 'shake', with the key taps?"),
        ({"phases.1.type": "Pour"}, "phases.1.type: 'Pour' is not known; did you mean 'deposit'?"),
        ({"particle": {"shape": "worm"}}, "particle.shape: 'worm' is not known; did you mean 'filament'?"),
        (
            {"particle": {"shape": "hook", "shank_m": 0.01, "radius_m": 0.004, "angle_deg": 3.14}},
            "particle.angle_deg: 3.14 deg is out of range; use at least 10 deg; 3.14 rad are 179.9 deg",
        ),
        ({"phases.1.type": "relaks"}, "phases.1.type: 'relaks' is not known; did you mean 'relax'?"),
        ({"motor": {"law": "servoo"}}, "motor.law: 'servoo' is not known; did you mean 'servo'?"),
        ({"motor": {"law": "x"}}, "motor.law: 'x' is not known; use 'halt', 'stall', 'ease', 'slip' or 'servo'"),
    ],
)
def test_a_value_that_is_nearly_a_known_one(scene_data: SceneData, changes: dict[str, Any], stated: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data(changes), source="bad.yaml")
    assert str(caught.value) == f"bad.yaml: {stated}"


def rejected(folder: Path, content: str | bytes, overrides: Sequence[str] = ()) -> str:
    """The message with which a file is rejected, the folder cut off."""
    path = folder / "bad.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        load_scene(path, overrides)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message.replace(f"{folder}/", "")


def test_key_given_twice(tmp_path: Path) -> None:
    line = GOOD.count("\n") + 1
    stated = f"bad.yaml, line {line}, column 1: not valid YAML: key 'seed' is given twice; keep one of the two"
    assert rejected(tmp_path, GOOD + "seed: 2\n") == stated
    nested = GOOD + "smarticle: {aspect_ratio: 0.4, aspect_ratio: 0.7}\n"
    assert "key 'aspect_ratio' is given twice" in rejected(tmp_path, nested)


def test_file_that_is_no_yaml(tmp_path: Path) -> None:
    message = rejected(tmp_path, "a: [1\nb")
    assert message.startswith("bad.yaml, line 2, column 2: not valid YAML: expected ',' or ']'")
    assert message.endswith("; correct this line")
    for tabbed in (GOOD + "\tname: x\n", GOOD + "name:\tx\n", GOOD + "motor:\n\tlaw: slip\n"):
        line = tabbed[: tabbed.index("\t")].count("\n") + 1
        stated = rejected(tmp_path, tabbed)
        assert stated.startswith(f"bad.yaml, line {line}, column ")
        assert stated.endswith(": not valid YAML: a tab; YAML is indented and spaced by blanks")
    assert "could not determine a constructor" in rejected(tmp_path, GOOD + "name: !!python/object:os.system x\n")


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("seed", "--set seed: write KEY=VALUE, e.g. --set phases.1.duration_s=2"),
        ("=3", "--set =3: write KEY=VALUE, e.g. --set phases.1.duration_s=2"),
        (
            "phases.3.duration_s=1",
            "--set phases.3.duration_s=1: there is no '3' in the scene; lists are numbered from 0",
        ),
        (
            "phases.duration_s=1",
            "--set phases.duration_s=1: there is no 'duration_s' in the scene; lists are numbered from 0, "
            "as in phases.0.duration_s",
        ),
        ("count.x=1", "--set count.x=1: there is no 'x' in the scene; lists are numbered from 0"),
        ("seed=[1", "--set seed=[1: the value is not valid YAML"),
        ("count=4O", "--set count=4O: count: got the text '4O', expected a number; write it in digits"),
        ("length_m=1", "--set length_m=1: unknown key 'length_m'; it belongs in hooks or particle"),
        ("phases.0.to_height_m=1", "--set phases.0.to_height_m=1: phases.0: unknown key 'to_height_m'; known keys: "),
        (
            "smarticle.length_m=1",
            "--set smarticle.length_m=1: smarticle: unknown key 'length_m'; did you mean 'middle_length_m'?",
        ),
        ("smarticle.w=1", "--set smarticle.w=1: smarticle: unknown key 'w'; known keys: "),
        (
            "gravity_m_per_s2=yes",
            "--set gravity_m_per_s2=yes: gravity_m_per_s2: got the boolean true, expected a number",
        ),
        ("smarticle.middle_length_m=11.7", f"--set smarticle.middle_length_m=11.7: {W_IN_MM}"),
        (
            "contact.friction_wall=.nan",
            "--set contact.friction_wall=.nan: contact.friction_wall: nan is not a finite number; give one",
        ),
    ],
)
def test_bad_override(tmp_path: Path, override: str, expected: str) -> None:
    message = rejected(tmp_path, GOOD, [override])
    assert message.startswith(expected) if expected.endswith(": ") else message == expected


@pytest.mark.parametrize(
    ("content", "overrides", "begin"),
    [
        (GOOD, ["seed=2", "count=0", "name=x"], "--set count=0: count: 0 is out of range"),
        (GOOD, ["phases=[]", "phases=[{type: deposit}]", "count=0"], "--set count=0: count: "),
        (GOOD.replace("count: 10", "count: 0"), ["seed=2"], "bad.yaml: count: 0 is out of range"),
        (GOOD.replace("count: 10", "count: 0"), ["count=3", "seed=-1"], "--set seed=-1: seed: -1 is"),
    ],
)
def test_an_error_names_the_override_that_brought_it(
    tmp_path: Path, content: str, overrides: list[str], begin: str
) -> None:
    assert rejected(tmp_path, content, overrides).startswith(begin)


BOMB = "".join(f"- &a{k} [{', '.join([f'*a{k - 1}'] * 9) if k else 'x'}]\n" for k in range(12))


@pytest.mark.parametrize(
    ("content", "stated"),
    [
        (GOOD + "name:\n" + BOMB, "more than 200000 characters with all aliases (*) written out; use fewer"),
        (GOOD.replace("phases: [{type: deposit}]", "phases:\n" + BOMB), "with all aliases (*) written out"),
        (GOOD + "name: &a [*a]\n", "with all aliases (*) written out"),
        (GOOD + "name: [&a " + "x" * 9999 + 30 * ", *a" + "]\n", "with all aliases (*) written out"),
        (GOOD + "name: " + "x" * 200_000, "more than 200000 characters, which no scene or sweep needs; shorten it"),
    ],
)
def test_a_text_that_stands_for_gigabytes_is_rejected_before_it_is_expanded(
    tmp_path: Path, content: str, stated: str
) -> None:
    message = rejected(tmp_path, content)
    assert message.startswith("bad.yaml: not valid YAML: more than 200000 characters")
    assert stated in message


def test_a_few_aliases_and_merged_keys_are_read(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(
        GOOD.replace("[{type: deposit}]", "[{type: deposit}, &r {type: relax, duration_s: 1}, *r, {<<: *r}]")
    )
    assert [phase.kind for phase in load_scene(path).phases] == ["deposit", "relax", "relax", "relax"]


def test_a_file_without_end_is_not_read_on() -> None:
    with pytest.raises(InputError, match="more than 200000 characters"):
        load_scene("/dev/zero")
