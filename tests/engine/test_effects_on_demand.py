"""Effects on demand: a scene is made of what it calls for and nothing else; an effect of no strength changes nothing.

What exists is read from YADE's own lists and from the files of the run, and is compared with what `dem.plan.effects`
declares.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cases
import meshio
import numpy as np
import pytest
from processes import series

Simulate = Callable[..., dict[str, Any]]

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
    "slipping motors": data(HOLD, motor={"law": "slip"}),
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
    made = simulate(cases.inventory, SCENES[name], str(tmp_path / "run"))
    # Found in YADE's lists at every sample, in the datasets, in the frames and in the folder, against the declaration.
    assert made["found"] == made["declared"]
    moves, hinges = name == "all", name != "plain"
    assert made["engines"] == {SHAKEN if moves else CORE}
    assert made["planned"] == set(*made["engines"])
    # Contacts and bonds that were really there, and what the law was given to work with.
    bonds = {("GridNodeGeom6D", "CohFrictPhys")} if hinges else set()
    assert made["contacts"] == {("ScGeom", "ViscElPhys")} | bonds
    assert any(cap > 0 for cap in made["caps"]) == (name == "slipping motors")


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


def differing(one: Path, other: Path, until: int | None = None) -> list[str]:
    """Datasets of `one` and arrays of its frames whose bits differ in `other`, which may have more of them.

    With `until`, samples and frames of the phases before that one.
    """
    first, second = series(one), series(other)
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
        (data(SHAKE), data(SHAKE, recording={"sphere_interval_s": 0.02, "dissipation_interval_s": 1e-3})),
        (data({**RELAX, "duration_s": 0.1}), data({**SHAKE, "peak_acceleration_g": 0})),
    ],
    ids=["sphere glyphs and energy account", "shaking at Γ = 0"],
)
def test_what_only_records_or_has_no_strength_changes_no_bit(
    run: Callable[[dict[str, Any]], Path], plain: dict[str, Any], more: dict[str, Any]
) -> None:
    assert differing(run(plain), run(more)) == []


def test_the_comparison_sees_the_smallest_change(run: Callable[[dict[str, Any]], Path]) -> None:
    stronger = data({**SHAKE, "peak_acceleration_g": 2.0000000001})
    assert differing(run(data(SHAKE)), run(stronger), until=2) == []
    assert len(differing(run(data(SHAKE)), run(stronger))) > 10


# -- checkpoints ---------------------------------------------------------------------------------------------------


def test_energies_of_contacts_are_known_right_after_a_checkpoint(simulate: Simulate, tmp_path: Path) -> None:
    # YADE does not save overlaps; a wall that goes away at a checkpoint must not make the ledger NaN.
    scene = data(REMOVE, recording={"dissipation_interval_s": 1e-3})
    ledger = simulate(cases.ledger_after_reload, scene, str(tmp_path))
    assert ledger["before"][0] > 1e-9
    assert ledger["after"] == pytest.approx(ledger["before"], rel=1e-12)
    assert np.isfinite(ledger["dissipated"])
