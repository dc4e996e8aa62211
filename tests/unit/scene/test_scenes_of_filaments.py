"""Reading scenes of filaments: what they become, and what is refused in one line."""

import copy
import math
from typing import Any

import pytest
from scenes import SMALL, changed, small

from dem.errors import InputError
from dem.phases.wriggle import Wriggle
from dem.plan.outlook import plan
from dem.scene.reading import dump_scene, parse_scene, scene_hash

WORM: dict[str, Any] = {"shape": "filament", "length_m": 0.03, "diameter_m": 8e-4, "young_modulus_Pa": 5e4}
POUR = {"type": "deposit", "per_layer": 5}
LIFT = {"type": "lift", "distance_m": 0.015, "speed_m_per_s": 0.005}
WRIGGLE = {"type": "wriggle", "duration_s": 1, "curvature_per_m": 100}
BLOB = {
    "engine": "links",
    "particle": WORM,
    "liquid": {},
    "fidelity": {"base": "standard", "stiffness_N_per_m": 10},
    "phases": [POUR, WRIGGLE, LIFT, {"type": "release"}],
}

HASH = "35ac778f3dfbb9e1418b926426edbad40303818361917b2b48a9e0bff3ffba28"  # of BLOB, without keys added later


def refused(changes: dict[str, Any]) -> str:
    with pytest.raises(InputError) as raised:
        parse_scene(changed({**SMALL, **BLOB}, changes), source="blob.yaml")
    return str(raised.value).removeprefix("blob.yaml: ")


def test_a_filament_is_what_its_keys_say() -> None:
    filament = small(BLOB).bodies[0].filament
    assert filament is not None
    assert (filament.nodes, filament.length, filament.diameter) == (13, 0.03, 8e-4)
    assert filament.weight_share == pytest.approx(1 - 1000 / 1060)
    assert small(BLOB).model.mass == pytest.approx(filament.mass, rel=1e-12)
    assert small({**BLOB, "liquid": None}).bodies[0].filament.weight_share == 1  # type: ignore[union-attr]


def test_it_is_poured_as_an_arc_of_its_length() -> None:
    bars = small({**BLOB, "particle.poured_bend_deg": 180}).bodies[0].bars  # type: ignore[union-attr]
    assert bars.lengths.sum() == pytest.approx(0.03)
    assert abs(bars.points[0, 0] - bars.points[-1, 1]).max() == pytest.approx(2 * 0.03 / 3.14159, rel=0.02)


def test_a_scene_reads_what_it_writes_and_liquid_counts() -> None:
    scene = small(BLOB)
    import yaml  # noqa: PLC0415 - only here

    again = parse_scene(yaml.safe_load(dump_scene(scene)), source="again")
    assert scene_hash(again) == scene_hash(scene)
    assert scene_hash(small({**BLOB, "liquid": None})) != scene_hash(scene)
    assert "liquid" not in dump_scene(small({}))


def test_scenes_without_roll_drag_keep_the_hash_of_before_it_was_a_key() -> None:
    bare, none, some = small(BLOB), *(small({**BLOB, "particle.roll_drag_N_s": drag}) for drag in (0.0, 1e-5))
    assert scene_hash(bare) == scene_hash(none) == HASH
    assert scene_hash(some) != HASH
    assert "roll_drag" not in dump_scene(none)
    assert "roll_drag_N_s: 1.0e-05" in dump_scene(some)
    filaments = [scene.bodies[0].filament for scene in (bare, some)]
    assert [each and each.roll_drag for each in filaments] == [0.0, 1e-5]


def test_a_wriggle_says_what_filaments_do() -> None:
    phase = Wriggle(type="wriggle", duration_s=1, curvature_per_m=80, frequency_hz=2, turns_between_reversals=0.25)
    activity = phase.activity
    assert activity.rate == pytest.approx(4 * 3.14159265)
    # γ = α/2πλ
    assert activity.rate / (2 * 3.14159265 * activity.reversal_rate) == pytest.approx(0.25)


def test_a_plan_has_their_step_and_effects() -> None:
    found = plan(small(BLOB))
    assert found.time_step_s < found.stable_time_step_s < 1e-3
    assert any(each.name == "filaments" and each.on for each in found.effects)
    assert not any(each.name == "filaments" and each.on for each in plan(small({"engine": "links"})).effects)
    stiff = plan(small({**BLOB, "particle.young_modulus_Pa": 1e11}))
    assert any("particle.young_modulus_Pa" in line for line in stiff.warnings)
    tight = plan(small({**BLOB, "phases.1.curvature_per_m": 1000}))
    assert any("phases.1.curvature_per_m" in line for line in tight.warnings)


@pytest.mark.parametrize(("changes", "message"), [
    ({"engine": "yade"}, "phases.1 (wriggle): active bending: only engine: links computes that"),
    ({"engine": "lammps"}, "particle: filament on engine: lammps, which has none; use engine: links"),
    ({"particle.segments": 60}, "particle.shape: filament: bar 0: 0.0005 m long; make it longer than its thickness"),
    ({"particle.young_modulus_Pa": -1}, "particle.young_modulus_Pa: -1 Pa is out of range; use at least 1 Pa"),
    ({"particle.roll_drag_N_s": -1}, "particle.roll_drag_N_s: -1 N s is out of range; use at least 0 N s"),
    ({"particle.roll_drag_N_s": 2}, "particle.roll_drag_N_s: 2 N s is out of range; use at most 1 N s"),
    ({"particle.roll_drag_N_s": math.inf}, "particle.roll_drag_N_s: inf is not a finite number; give one in N s"),
    ({"particle": {**WORM, "thickness_in_plane_m": 1e-3}}, "particle.diameter_m: a round section has no thicknesses"),
    ({"particle": [WORM, {"shape": "rod", "length_m": 0.01}]}, "particle: filaments and other shapes do not mix"),
    ({"particle": None}, "liquid: only filaments float in it"),
    ({"particle.density_kg_per_m3": 999},
     "particle.density_kg_per_m3: 999 kg/m³ is no more than liquid.density_kg_per_m3 = 1000 kg/m³"),
    ({"liquid.density_kg_per_m3": 1060}, "particle.density_kg_per_m3: 1060 kg/m³ is no more than"),
    ({"particle": None, "liquid": None}, "phases.1: wriggle needs filaments"),
    ({"recording": {"contact_forces": True}}, "recording.contact_forces: forces at contacts of filaments"),
    ({"plane": {}}, "plane: motion in a plane is that of smarticles"),
    ({"motor": {"law": "stall"}}, "motor: other shapes have no hinges"),
    ({"phases.2.duration_s": 1}, "phases.2.duration_s: 1 s is too short to raise by distance_m = 0.015 m"),
    ({"phases.2.speed_m_per_s": 0}, "phases.2.speed_m_per_s: 0 m/s is out of range"),
    ({"phases.1.wavelength_m": 0.004},
     "phases.1.wavelength_m: 0.004 m is less than two segments, of 0.0025 m each; use at least 0.005 m"),
    ({"phases.1.frequency_hz": -1}, "phases.1.frequency_hz: -1 Hz is out of range; use at least 0 Hz"),
    ({"container.radius_m": 0.01}, "container.radius_m: 0.01 m is narrower than a body"),
    ({"phases.2": {"type": "internal-oscillation", "theta_deg": 5, "duration_s": 1}},
     "phases.2: internal-oscillation needs smarticles, which have barbs, but particle has other shapes"),
])  # fmt: skip
def test_one_line_says_what_is_wrong_and_what_to_do(changes: dict[str, Any], message: str) -> None:
    found = refused(changes)
    assert found.startswith(message)
    assert "\n" not in found


PASSIVE = {"engine": "yade", "phases": [POUR, {"type": "shake", "duration_s": 0.1, "frequency_hz": 30}]}


def test_yade_computes_passive_filaments() -> None:
    scene = small({**BLOB, **PASSIVE})
    found = plan(scene)
    assert found.time_step_s < found.stable_time_step_s < 1e-3
    # Well below the limit of stretching alone, √2 over its highest frequency.
    filament = scene.bodies[0].filament
    assert filament is not None
    assert found.stable_time_step_s < (2 / filament.stiffest[0]) ** 0.5


@pytest.mark.parametrize(("changes", "message"), [
    ({"phases.1": WRIGGLE}, "phases.1 (wriggle): active bending: only engine: links computes that"),
    ({"phases.1": LIFT}, "phases.1 (lift): a grip: only engine: links computes that"),
    ({"phases.1": {"type": "remove-container", "duration_s": 0.1, "speed_m_per_s": 0.1}},
     "phases.1.speed_m_per_s: on engine: yade only the nodes of filaments touch boundaries, not edges"),
    ({"hooks": {"lower_height_m": 0.003, "upper_height_m": 0.006}}, "hooks: on engine: yade only the nodes"),
    ({"recording": {"dissipation_interval_s": 2e-3}}, "recording.dissipation_interval_s: on engine: yade"),
])  # fmt: skip
def test_one_line_says_what_filaments_on_yade_do_not_have(changes: dict[str, Any], message: str) -> None:
    found = refused(copy.deepcopy(PASSIVE) | changes)
    assert found.startswith(message)
    assert "engine: links" in found
    assert "\n" not in found


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ({"nodes": [13]}, "phases.2.nodes: there is no 13 in a body of 13; use 0 to 12, or -1 to -13"),
        ({"nodes": [0, -14]}, "phases.2.nodes: there is no -14 in a body of 13; use 0 to 12, or -1 to -13"),
        ({"nodes": [0], "grips": "tails"}, "phases.2.nodes: tails are the last nodes; leave nodes or grips out"),
    ],
)
def test_nodes_that_a_filament_does_not_have_are_not_gripped(nodes: dict[str, Any], message: str) -> None:
    assert refused({"phases.2": {**LIFT, **nodes}}) == message
    assert small({**BLOB, "phases.2": {**LIFT, "nodes": [12, -13]}})
