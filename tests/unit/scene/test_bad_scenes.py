"""Every bad scene is rejected with one line: key, value with its unit, way out."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from scenes import CHAIN, SMALL, changed

from dem.errors import InputError
from dem.scene.reading import parse_scene

Bad = list[tuple[dict[str, Any], str, str]]
"""What is changed in a good scene; the key that the line begins with, and the value that it shows."""

DEPOSIT = {"type": "deposit"}
TIER = {"radius_m": 0.02, "height_m": 0.05}
TIERS = [{"radius_m": 0.0234, "height_m": 0.012}, {"radius_m": 0.018, "height_m": 0.012}]
PULL, REMOVE = {"type": "pull-hook"}, {"type": "remove-container"}
RELAX, SHAKE = {"type": "relax", "duration_s": 0.1}, {"type": "shake", "duration_s": 0.1}
HOLD = {"type": "hold"}
RAMP = {"type": "ramp", "to_deg": 0, "duration_s": 1}
SINE = {"type": "sine", "centre_deg": 90, "amplitude_deg": 5, "frequency_hz": 1}
TRIANGLE = {"type": "triangle", "centre_deg": 90, "amplitude_deg": 5, "speed_rad_per_s": 6}
BOUNCING = {"type": "actuate", "barbs": {"type": "sequence", "steps": 3}, "duration_s": 1}
SHAPE_CHANGE = {"type": "shape-change"}
OSCILLATION = {"type": "internal-oscillation", "theta_deg": 10}


def on(*phases: dict[str, Any]) -> dict[str, Any]:
    """A pour and some phases."""
    return {"phases": [DEPOSIT, *phases]}


def actuate(barbs: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {"type": "actuate", **({"barbs": barbs} if barbs else {}), **more}


def sequence(*steps: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"type": "sequence", "steps": list(steps), **more}


SCENE: Bad = [
    ({"smarticle.middle_length_m": -0.0117}, "smarticle.middle_length_m", "-0.0117"),
    ({"smarticle.middle_length_m": math.nan}, "smarticle.middle_length_m", "nan"),
    ({"smarticle.angles_deg": [120, 90]}, "smarticle.angles_deg", "120"),
    ({"smarticle.thickness_normal_m": 0.008}, "smarticle", "0.008 m"),
    ({"smarticle.middle_length_m": 11.7}, "smarticle.middle_length_m", "11.7"),
    ({"smarticle.density_kg_per_m3": 7.85}, "smarticle.density_kg_per_m3", "7.85 kg/m³"),
    ({"count": 5000, "container.height_m": 0.01}, "count", "5000"),
    ({"engine": "abacus"}, "engine", "'abacus'"),
    ({"count": "ten"}, "count", "got the text 'ten'"),
    ({"smarticle.aspect_ration": 0.5}, "smarticle", "unknown key 'aspect_ration'"),
    ({"cont": 3}, "", "unknown key 'cont'"),
    ({"fidelity": {"base": ["draft"]}}, "fidelity", "unknown fidelity ['draft']"),
    ({"fidelity": {"smarticle": 1}}, "fidelity", "unknown key 'smarticle'"),
    ({"fidelity": {"engine": [1]}}, "fidelity", "unknown key 'engine'"),
    ({"smarticle.aspect_ratio": 2, "smarticle.angles_deg": [105, 105]}, "smarticle.angles_deg", "105"),
    ({"schema_version": 3}, "schema_version", "3"),
    ({"fidelity": {"rows": 2, "diameter_m": 0.002}}, "fidelity.rows", "2"),
    ({"fidelity": {"diameter_m": 0.009}}, "fidelity.diameter_m", "0.009 m"),
    ({"phases": [{"type": "relax"}]}, "phases", "got relax"),
    ({"container": {"tiers": [TIER], "packing_radius_m": 0.02}}, "container.packing_radius_m", "0.02 m"),
    ({"phases": [{"type": "deposit"}, {"type": "deposit"}]}, "phases", "got deposit"),
    ({"phases.1": {"duration_s": 1}}, "phases.1.type", "missing"),
    ({"phases.1": "relax"}, "phases.1", "'relax'"),
    ({"recording.dissipation_interval_s": 10}, "recording.dissipation_interval_s", "10"),
    ({"recording.frame_interval_s": 0.05}, "recording.frame_interval_s", "0.05"),
    ({"phases.1.duration_s": 0.001}, "phases.1.duration_s", "0.001"),
    ({"container": {"tiers": []}}, "container.tiers", "an empty list"),
    ({"phases.1": BOUNCING}, "phases.1.barbs.steps", "3"),
    ({"name": 5}, "name", "5"),
    ({"recording": {"energy": "yes"}}, "recording.energy", "'yes'"),
]

HOOKS: Bad = [
    ({"phases": [DEPOSIT, PULL]}, "phases.1", "pull-hook"),
    ({"hooks": {}, "phases": [DEPOSIT, {**PULL, "distance_m": 23.4}]}, "phases.1.distance_m", "23.4"),
    ({"hooks": {}, "phases": [DEPOSIT, {**PULL, "which": "lower"}]}, "phases.1.which", "'lower'"),
    ({"phases": [DEPOSIT, REMOVE, SHAKE, REMOVE]}, "phases.3", "remove-container"),
    ({"phases": [DEPOSIT, {**SHAKE, "frequency_hz": 0.01}]}, "phases.1.frequency_hz", "0.01 Hz at Γ = 2"),
    ({"hooks": {"length_m": 0.048}}, "hooks.length_m", "0.048"),
    ({"hooks": {"lower_length_m": 0.048, "lower_bars": 3}}, "hooks.lower_length_m", "0.048"),
    ({"hooks": {"lower_length_m": 0.01, "lower_bars": 12}}, "hooks.lower_bars", "no room between them"),
    ({"hooks": {"lower_height_m": 2e-4}}, "hooks.lower_height_m", "0.0002"),
    ({"hooks": {"upper_height_m": 0.0054}}, "hooks.upper_height_m", "0.0054"),
    ({"hooks": {"upper_height_m": 0.2}, "container.height_m": 0.1}, "hooks.upper_height_m", "0.2"),
    ({"container": {"tiers": [{**tier, "height_m": 0.01} for tier in TIERS]}}, "container.tiers", "0.02"),
    ({"container.height_m": 0.02}, "container.height_m", "0.02"),
    ({"hooks": {"side_m": 0.02}}, "hooks.side_m", "0.02"),
    ({"container": {"tiers": [TIERS[1], TIERS[0]]}}, "container.tiers.1.radius_m", "0.0234"),
    ({"container": {"tiers": TIERS, "radius_m": 0.02}}, "container.radius_m", "0.02"),
    ({"container": {"tiers": [*TIERS, {"radius_m": 0.005, "height_m": 0.01}]}}, "container.tiers.2.radius_m", "0.005"),
    (
        {
            "container": {"tiers": [*TIERS, {"radius_m": 0.0125, "height_m": 0.1}]},
            "hooks": {"length_m": 0.03},
            "phases": [DEPOSIT, PULL],
        },
        "hooks.length_m",
        "0.03",
    ),
]

ACTUATED: Bad = [
    (on(actuate()), "phases.1.barbs", "missing"),
    (on(actuate(barb_2=RAMP)), "phases.1.barb_1", "missing"),
    (on(actuate(RAMP, barb_1=RAMP)), "phases.1.barbs", "one motion for both barbs"),
    (on(actuate(SINE)), "phases.1.duration_s", "missing"),
    (on(actuate(RAMP, duration_s=2)), "phases.1.barbs", "the motion ends after 1 s"),
    (on(actuate(barb_1=RAMP, barb_2={**HOLD, "duration_s": 3})), "phases.1.barb_1", "the motion ends after 1 s"),
    (on({**SHAPE_CHANGE, "opening_s": 0.001, "closing_s": 0.002}), "phases.1", "0.003"),
    (
        on(actuate(barb_1=SINE, barb_2=sequence(RAMP, HOLD), duration_s=2, offsets="random")),
        "phases.1.offsets",
        "random",
    ),
    (on(actuate(RAMP, active_fraction=0.04)), "phases.1.active_fraction", "0.04"),
    (on(actuate({**RAMP, "to_deg": 110})), "phases.1.barbs.to_deg", "110"),
    (on(actuate({**SINE, "amplitude_deg": 20}, duration_s=2)), "phases.1.barbs.amplitude_deg", "20"),
    (
        on(
            actuate(
                barb_1=HOLD, barb_2=sequence(RAMP, {**TRIANGLE, "centre_deg": 0, "amplitude_deg": 19}), duration_s=2
            )
        ),
        "phases.1.barb_2.steps.1.amplitude_deg",
        "19",
    ),
    (on({**OSCILLATION, "theta_deg": 40}), "phases.1.theta_deg", "40"),
    (on(actuate({**RAMP, "duration_s": 0.25})), "phases.1.barbs.duration_s", "0.25"),
    (
        on(actuate(sequence(RAMP, sequence(HOLD | {"duration_s": 1}, {"type": "return", "duration_s": 0.1})))),
        "phases.1.barbs.steps.1.steps.1.duration_s",
        "0.1",
    ),
    (on(actuate({**SINE, "frequency_hz": 15}, duration_s=1)), "phases.1.barbs.frequency_hz", "15"),
    (on(actuate({**TRIANGLE, "speed_rad_per_s": 6.1}, duration_s=1)), "phases.1.barbs.speed_rad_per_s", "6.1 rad/s"),
    (on({**SHAPE_CHANGE, "closing_s": 0.2, "straight_hold_s": 1}), "phases.1.closing_s", "0.2"),
    (on(actuate(sequence(RAMP, {"type": "ramp", "to_deg": 3}))), "phases.1.barbs.steps.1.duration_s", "missing"),
    (on(actuate(sequence(HOLD, RAMP))), "phases.1.barbs.steps.0", "hold has no end"),
    ({**on(SHAPE_CHANGE), "fidelity": {"control_interval_s": 3e-4}}, "fidelity.control_interval_s", "0.0003"),
    ({**on(SHAPE_CHANGE), "smarticle.aspect_ratio": 0}, "smarticle.aspect_ratio", "0"),
    (
        {**on(SHAPE_CHANGE), "smarticle.aspect_ratio": 0.15, "fidelity": {"diameter_m": 1.2e-3}},
        "smarticle.aspect_ratio",
        "0.15",
    ),
]

THICK = "smarticle.middle_thickness_in_plane_m"
CHAINS: Bad = [
    ({"plane.width_m": 0.062}, "plane.width_m", "0.062 m"),
    ({"plane.width_m": 0.16}, "plane.width_m", "H = 0.16 m"),
    ({"plane": None}, "phases.0", "arrange needs motion confined to a plane"),
    ({"phases.1.string_length_m": 0.001}, "phases.1.string_length_m", "0.001"),
    ({"count": 1}, "count", "1"),
    ({"phases.0": {"type": "relax"}}, "phases.0", "relax"),
    ({"phases.0.gap_m": 0.01}, "phases.0.gap_m", "0.0095 m"),
    ({"hooks": {}}, "hooks", "they lie out of the plane"),
    ({"container": {"radius_m": 0.1}}, "container", "a scene in a plane has none"),
    ({"smarticle.angles_deg": [80, 90]}, "smarticle.angles_deg", "a chain is laid out of U shapes"),
    ({"motor.law": "halt", "motor.damping_N_m_s_per_rad": 1e-3}, "motor.damping_N_m_s_per_rad", "0.001"),
    ({"fidelity.rows": 2, "fidelity.diameter_m": 0.004}, "fidelity.rows", "2"),
    ({THICK: 0.024}, "smarticle", "0.024 m"),
    ({THICK: 0.02, "engine": "links"}, THICK, "0.02 m on engine: links"),
    ({THICK: 0.02, "engine": "lammps"}, "engine", "plane"),
    ({THICK: 0.02, "smarticle.aspect_ratio": 0.4}, THICK, "0.01868 m"),
    ({THICK: 0.021, "plane.width_m": 0.079}, "plane.width_m", "0.079 m"),
]

# Ways to say what to do instead.
WAY_OUT = re.compile(r"; \S|\bexpected \S|° … ")


def rejected(good: Mapping[str, Any], changes: Mapping[str, Any]) -> str:
    with pytest.raises(InputError) as caught:
        parse_scene(changed(good, changes), source="bad.yaml")
    return str(caught.value).removeprefix("bad.yaml: ")


TABLES: list[tuple[Mapping[str, Any], Bad]] = [(SMALL, [*SCENE, *HOOKS, *ACTUATED]), (CHAIN, CHAINS)]
ALL = [(good, *row) for good, table in TABLES for row in table]


@pytest.mark.parametrize("good", [SMALL, CHAIN], ids=["small", "chain"])
def test_they_are_good_before_the_change(good: dict[str, Any]) -> None:
    parse_scene(good, source="good.yaml")


@pytest.mark.parametrize(("good", "changes", "key", "value"), ALL, ids=[f"{row[2]}-{row[3]}" for row in ALL])
def test_one_line_with_key_value_and_way_out(
    good: dict[str, Any], changes: dict[str, Any], key: str, value: str
) -> None:
    line = rejected(good, changes)
    assert len(line.splitlines()) == 1
    assert line.startswith(f"{key}: " if key else value)
    stated = line.removeprefix(f"{key}: ")
    assert re.search(rf"(?<![\w.]){re.escape(value)}(?![\w.]*\w)", stated), line
    assert WAY_OUT.search(stated), line
    assert "Value error" not in line  # as pydantic would begin it


def test_what_is_filled_in_from_a_wrong_value_is_no_second_error() -> None:
    line = rejected(SMALL, {"hooks": {"length_m": 11.7}})
    assert line.startswith("hooks.length_m: 11.7 means 11.7 m")
    assert line.count("11.7 means") == 1
    # Told twice where the file says it twice.
    both = rejected(SMALL, {"hooks": {"length_m": 11.7, "lower_length_m": 11.7}})
    assert both.count("11.7 means") == 2
    assert "; also hooks.lower_length_m: 11.7 means" in both


@pytest.mark.parametrize(("changes", "message"), [
    ({"shape": "ring"}, "unknown key 'shape'; scenes have no such key, see `particle` for shapes; docs/limits.md"),
    ({"contact": {"cohesion": 1.0}}, "contact: unknown key 'cohesion'; scenes have no cohesion; docs/limits.md lists"),
    ({"air": {"viscosity": 1.8e-5}}, "unknown key 'air'; scenes have no air or water; docs/limits.md lists"),
    ({"container": None}, "container: got null, but there is no scene without a container; leave the key out"),
])  # fmt: skip
def test_what_no_scene_can_describe_points_to_the_page_of_limits(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as raised:
        parse_scene({**SMALL, **changes}, source="scene.yaml")
    assert message in str(raised.value)


def test_every_shipped_scene_names_its_engine() -> None:
    root = Path(__file__).resolve().parents[3]
    files = [*root.glob("smarticles/starters/*.yaml"), *root.glob("studies/*.j2")]
    texts = {path.name: path.read_text(encoding="utf-8") for path in files}
    for path in (root / "README.md", *root.glob("docs/**/*.md")):
        for number, block in enumerate(re.findall(r"```yaml\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)):
            if "schema_version: 1" in block and "phases:" in block:
                texts[f"{path.name} {number}"] = block
        for number, call in enumerate(
            re.findall(r"smarticles\.Scene\((.*?)\n\)", path.read_text(encoding="utf-8"), re.S)
        ):
            texts[f"{path.name} Scene {number}"] = call.replace("engine=", "engine:")
    texts["gait.ipynb"] = (root / "examples" / "gait.ipynb").read_text(encoding="utf-8").replace("engine=", "engine:")
    assert len(texts) > 25
    assert [name for name, text in texts.items() if "engine:" not in text] == []
