"""Effects on demand: a scene is made of what it calls for and of nothing else, and no strength has no consequence.

What exists is read from YADE's own lists, from the files of the run and from Python's profiler, and is compared with
what `dem.plan.effects` declares; so an effect that builds more than it says, or says more than it builds, is found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cases
import effect_cases
import h5py
import meshio
import numpy as np
import pytest

pytestmark = pytest.mark.engine

Simulate = Callable[..., dict[str, Any]]
Columns = dict[str, np.ndarray]

DEPOSIT = {"type": "deposit", "per_layer": 4}
RELAX = {"type": "relax", "duration_s": 0.04}
SHAKE = {"type": "shake", "duration_s": 0.1}
HOLD = {"type": "actuate", "barbs": {"type": "hold"}, "duration_s": 0.1}
REMOVE = {"type": "remove-container", "duration_s": 0.04}
CORE = ("ForceResetter", "InsertionSortCollider", "InteractionLoop", "NewtonIntegrator")
SHAKEN = (*CORE[:3], "HarmonicMotionEngine", CORE[3])


def data(*phases: dict[str, Any], recording: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {
        "schema_version": 1,
        "seed": 2,
        "count": 8,
        "fidelity": "draft",
        "container": {"radius_m": 0.0145, "height_m": 0.15},
        "recording": {"checkpoint_interval_s": None, "frame_interval_s": 0.02, **(recording or {})},
        "phases": [DEPOSIT, RELAX, *phases],
        **more,
    }


# -- (a) an effect that is absent leaves nothing behind ------------------------------------------------------------

SCENES = {
    "plain": data(),
    "container motion": data(SHAKE),
    "articulation and motors": data(HOLD),
    "slipping motors": data(HOLD, motor={"law": "slip"}),
    "hooks": data(hooks={"lower_height_m": 0.003, "upper_height_m": 0.006}),
    "wall removal": data(REMOVE),
    "energies": data(recording={"energy": True}),
    "energy account": data(recording={"dissipation_interval_s": 2e-3}),
    "sphere glyphs": data(recording={"sphere_interval_s": 0.04}),
    "checkpoints": data(recording={"checkpoint_interval_s": 0.1}),
    "no friction": data(contact={"friction_smarticle": 0, "friction_wall": 0}),
    "no dashpot": data(contact={"restitution": 1}),
    "all": data(
        SHAKE,
        HOLD,
        REMOVE,
        hooks={"lower_height_m": 0.003, "upper_height_m": 0.006},
        recording={"checkpoint_interval_s": 0.1, "sphere_interval_s": 0.04, "dissipation_interval_s": 2e-3},
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_run_is_made_of_what_its_scene_calls_for_and_of_nothing_else(
    simulate: Simulate, tmp_path: Path, name: str
) -> None:
    scene = SCENES[name]
    if name.startswith("no "):
        # Such piles do not settle soon; they are poured with a criterion that is met.
        settle = {"speed_m_per_s": 10, "unbalanced_force": 1e3, "hold_s": 0}
        scene = {**scene, "phases": [{**DEPOSIT, "landed_speed_m_per_s": 5, "settle": settle}, RELAX]}
    made = simulate(effect_cases.inventory, scene, str(tmp_path / "run"))
    # Found in YADE's lists at every sample, in the datasets, in the frames and in the folder, against the declaration.
    assert made["found"] == made["declared"]
    moves, hinges = name in ("container motion", "all"), name in ("articulation and motors", "slipping motors", "all")
    assert made["engines"] == {SHAKEN if moves else CORE}
    assert made["planned"] == set(*made["engines"])
    # Contacts and bonds that were really there, and what the law was given to work with.
    bonds = {("GridNodeGeom6D", "CohFrictPhys")} if hinges else set()
    assert made["contacts"] == {("ScGeom", "ViscElPhys")} | bonds
    assert any(cap > 0 for cap in made["caps"]) == (name == "slipping motors")
    # Numbers of the one contact law: where they are nothing, so is what it works out of them.
    frictions, dashpots = map(set, zip(*made["coefficients"], strict=True))
    assert (frictions == {0}) == (name == "no friction")
    assert (dashpots == {0}) == (name == "no dashpot")
    assert (made["most_shear"] == 0) == (name == "no friction")


def test_the_scenes_of_this_proof_differ_in_what_they_are_made_of(simulate: Simulate, tmp_path: Path) -> None:
    plain = simulate(effect_cases.inventory, SCENES["plain"], str(tmp_path / "plain"))["found"]
    assert plain["shapes"] == {"Facet", "Wall", "Sphere", "Clump"}
    assert plain["materials"] == {"smarticle", "wall"}
    assert plain["files"] == {"series.h5", "frames", "frames.pvd"}
    assert len(plain["functors"]) == 8
    every = simulate(effect_cases.inventory, SCENES["all"], str(tmp_path / "all"))["found"]
    assert every["shapes"] - plain["shapes"] == {"GridNode", "Box"}
    assert every["materials"] - plain["materials"] == {"hinge"}
    assert every["files"] - plain["files"] == {
        "spheres",
        "spheres.pvd",
        "checkpoint.zip",
        "checkpoint.previous.zip",
    }
    assert len(every["functors"]) == 13
    assert len(every["series"] - plain["series"]) == 19


@pytest.mark.parametrize(
    ("scene", "moving", "expected"),
    [
        (data(SHAKE), True, {}),
        (data(recording={"energy": True}), False, {}),
        (data(SHAKE, recording={"energy": True}), True, {"YadeFixtures.power": 1}),
        (data(HOLD), False, {}),
        (data(recording={"sphere_interval_s": 0.04, "checkpoint_interval_s": 0.1}), False, {}),
        (data(hooks={}), False, {"YadeFixtures.feel": 1}),
    ],
)
def test_python_is_called_in_every_step_for_hooks_and_for_work_only(
    simulate: Simulate, scene: dict[str, Any], moving: bool, expected: dict[str, float]
) -> None:
    calls = simulate(effect_cases.calls_per_step, scene, steps=100, moving=moving)
    # One call makes the step, whatever the scene.
    assert calls == {"YadeAccount.step": 1, **expected}


# -- (b) an effect of no strength changes nothing ------------------------------------------------------------------


@pytest.fixture(scope="module")
def run(worker: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[dict[str, Any]], Path]]:
    """Run a scene, once for all tests that ask for it."""
    folder, done = tmp_path_factory.mktemp("twins"), {}

    def make(scene: dict[str, Any]) -> Path:
        key = repr(scene)
        if key not in done:
            out = folder / str(len(done))
            answer = worker.submit(cases.run, scene, str(out)).result(300)
            assert answer["error"] is None, answer
            done[key] = out
        return done[key]

    return make


def columns(out: Path) -> Columns:
    with h5py.File(out / "series.h5") as file:
        return {name: dataset[()] for name, dataset in file.items()}


def differing(one: Path, other: Path, until: int | None = None) -> list[str]:
    """Datasets of `one` and arrays of its frames that are not the same, bit by bit, in `other`.

    Args:
        one: a run.
        other: the same with an effect more; what only it records is not compared.
        until: samples and frames of phases before this one only.
    """
    first, second = columns(one), columns(other)
    last = np.count_nonzero(first["phase"] < until) if until else None
    bits = [{name: values[:last].tobytes() for name, values in each.items()} for each in (first, second)]
    parted = sorted(name for name in bits[0] if bits[0][name] != bits[1].get(name))
    compared = 0
    for path in sorted((one / "frames").iterdir()):
        mesh, twin = meshio.read(path), meshio.read(other / "frames" / path.name)
        if until and mesh.cell_data["phase"][0][0] >= until:
            continue
        compared += 1
        arrays = {"points": (mesh.points, twin.points)}
        arrays |= {name: (mesh.cell_data[name][0], twin.cell_data[name][0]) for name in mesh.cell_data}
        parted += [f"{path.name} {name}" for name, (a, b) in arrays.items() if a.tobytes() != b.tobytes()]
    assert compared > 10  # comparing nothing with nothing proves nothing
    return parted


@pytest.mark.parametrize(
    ("plain", "more"),
    [
        (data(SHAKE), data(SHAKE, recording={"sphere_interval_s": 0.02})),
        (data(SHAKE), data(SHAKE, recording={"energy": True})),
        (data(SHAKE), data(SHAKE, recording={"dissipation_interval_s": 1e-3})),
        (data({**RELAX, "duration_s": 0.1}), data({**SHAKE, "peak_acceleration_g": 0})),
        (data(HOLD, motor={"torque_limit_N_m": 1.0}), data(HOLD, motor={"torque_limit_N_m": 1e3})),
    ],
    ids=["sphere glyphs", "energies", "energy account", "shaking at Γ = 0", "torque cap out of reach"],
)
def test_what_only_looks_or_has_no_strength_changes_no_bit(
    run: Callable[[dict[str, Any]], Path], plain: dict[str, Any], more: dict[str, Any]
) -> None:
    assert differing(run(plain), run(more)) == []


def test_the_comparison_sees_the_smallest_change(run: Callable[[dict[str, Any]], Path]) -> None:
    stronger = data({**SHAKE, "peak_acceleration_g": 2.0000000001})
    assert differing(run(data(SHAKE)), run(stronger), until=2) == []
    assert len(differing(run(data(SHAKE)), run(stronger))) > 10


@pytest.mark.parametrize("lift", [None, 0.1])
def test_taking_away_a_wall_that_nothing_touches_changes_no_bit(simulate: Simulate, lift: float | None) -> None:
    scene = data(REMOVE, container={"radius_m": 0.08, "height_m": 0.15}, count=6)
    removed = simulate(effect_cases.removal, scene, steps=2000, lift=lift)
    assert removed["same"]
    assert removed["walled"] == (lift is not None)
    # They moved and touched something else, or nothing could have changed.
    assert removed["contacts"] == 0
    assert removed["touching"] > 10
    assert removed["fastest"] > 1e-3


FINE = {"base": "draft", "time_step_s": 2e-5}  # the time step of welded and of hinged smarticles


def test_hinges_and_motors_that_are_yet_to_come_change_no_bit(run: Callable[[dict[str, Any]], Path]) -> None:
    welded = data(SHAKE, fidelity=FINE)
    assert differing(run(welded), run(data(SHAKE, HOLD, fidelity=FINE)), until=3) == []


def test_motors_that_hold_give_way_by_their_shafts_and_no_more(run: Callable[[dict[str, Any]], Path]) -> None:
    """Articulated smarticles whose motors hold are not welded ones: a shaft under load twists by τ/k, a pin gives way.

    So the pile settles a little into its springs, once. Bits are the same up to then.
    """
    welded, held = (data({**one, "duration_s": 0.1}, fidelity=FINE) for one in (RELAX, HOLD))
    assert differing(run(welded), run(held), until=2) == []
    still, hung = columns(run(welded)), columns(run(held))
    assert len(still["time_s"]) == len(hung["time_s"])
    torque, error = hung["motor_torque_N_m"][-1], hung["tracking_error_rad"][-1]
    assert 1e-7 < torque < 1.6e-5
    # The root mean square of τ/k over 16 motors is at most the largest error, and at least a quarter of it.
    assert torque / 3e-3 <= error * (1 + 1e-6)
    assert error <= 4 * torque / 3e-3
    # By a barb's length times its error at most, 16 µm: of the height of 2.7 mm the pile loses less than that.
    sunk = still["com_height_m"][-1] - hung["com_height_m"][-1]
    assert 0 < abs(sunk) < 0.7 * 0.0117 * error
    assert hung["kinetic_energy_J"][-1] < 1e-9


@pytest.mark.parametrize(
    ("more", "since"),
    [
        (data(SHAKE, hooks={"lower_height_m": 0.08, "upper_height_m": 0.09}), 0.0),
        (data(SHAKE, recording={"checkpoint_interval_s": 0.1}), 0.1),
    ],
    ids=["hooks far above the pile", "checkpoints"],
)
def test_what_changes_the_order_of_sums_begins_with_their_last_bits(
    run: Callable[[dict[str, Any]], Path], more: dict[str, Any], since: float
) -> None:
    """Contacts act in the order in which YADE keeps them, and a sum of floating-point numbers depends on its order.

    YADE orders them anew when it loads, as at a checkpoint. Hooks are four more bodies among those that the collider
    sorts, and its sort leaves bodies of equal bounds (the two facets of a panel) in an order that depends on how many
    bodies there are. From then on the two piles part as any two that differ by 1e-16 do: each collision multiplies it.
    """
    plain, other = columns(run(data(SHAKE))), columns(run(more))
    samples = min(len(plain["time_s"]), len(other["time_s"]))
    parted = [k for k in range(samples) if any(plain[name][k].tobytes() != other[name][k].tobytes() for name in plain)]
    assert parted
    first = parted[0]
    assert plain["time_s"][first] > since
    assert plain["kinetic_energy_J"][:first].max() > 0
    for name, values in plain.items():
        # Rounding errors of some hundred sums, where the null answer, another pile, is apart by as much as itself.
        assert other[name][first] == pytest.approx(values[first], abs=1e-10 * np.nanmax(np.abs(values))), name


def test_a_run_says_of_motors_that_one_look_takes_far_beyond_their_limit(
    run: Callable[[dict[str, Any]], Path],
) -> None:
    logs = [run(data(HOLD, motor=motor)) / "log.txt" for motor in ({"speed_limit_rad_per_s": 60}, {})]
    warned = ["WARNING motor.torque_limit_N_m: τ_max" in log.read_text() for log in logs]
    assert warned == [True, False]


# -- found on the way ----------------------------------------------------------------------------------------------


def test_energies_of_contacts_are_known_right_after_a_checkpoint(simulate: Simulate, tmp_path: Path) -> None:
    """YADE does not save how far bodies overlap; a wall that goes away at a checkpoint made the account no number."""
    scene = data(REMOVE, recording={"dissipation_interval_s": 1e-3})
    account = simulate(effect_cases.account_after_reload, scene, str(tmp_path))
    assert account["before"][0] > 1e-9
    assert account["after"] == pytest.approx(account["before"], rel=1e-12)
    assert np.isfinite(account["dissipated"])
