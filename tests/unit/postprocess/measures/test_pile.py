"""Where a pile has a packing fraction: not while bodies hang or fall; and which frames the means of a pour average."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import yaml
from synthetic import SyntheticRun, mesh_of, write_manifest
from synthetic.shapes import W

from dem.record.frames import FrameWriter
from dem.record.run import Run
from postprocess import measure_run, packing_fraction, summarise_run
from postprocess.measures.pile import why_no_pile
from postprocess.pictures.render import packing_text

PHI = "phi second-highest-com [-]"
HELD, FALLS = "a grip or a raised hook holds bodies", "the bodies have not settled"
LIMIT = 0.02  # m/s, speed of a settled pile

#: Phase, number of bodies, speed of one of them [m/s], and its rise [m]
Moment = tuple[int, int, float, float]
Recorded = Callable[[Sequence[str], Sequence[Moment]], Run]


@pytest.fixture
def recorded(tmp_path: Path) -> Recorded:
    """Writes a run of 12 smarticles, of which one moves and is raised, with a frame for each moment."""

    def write(phases: Sequence[str], moments: Sequence[Moment]) -> Run:
        made = SyntheticRun(phases=tuple(phases))
        write_manifest(tmp_path, made)
        scene = {"phases": [{"type": "deposit", "settle": {"speed_m_per_s": LIMIT}}]}
        (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
        writer, vertices = FrameWriter(tmp_path), made.vertices(0.12)
        for number, (phase, count, speed, rise) in enumerate(moments):
            # All links of a body have its speed; those of the others are at rest.
            mesh = mesh_of((vertices + [0, 0, 1] * np.eye(12)[0][:, None, None] * rise)[:count], phase=phase)
            mesh.cell_data["time_s"][0][:] = 0.1 * number
            mesh.cell_data["velocity_m_per_s"][0][:3] = [0, 0, speed]
            writer.write(mesh, 0.1 * number)
        return Run(tmp_path)

    return write


@pytest.mark.parametrize(
    ("phases", "speed", "reason"),
    [
        (("deposit", "relax"), 1.0, ""),  # of a phase that is not the pour, all frames count
        (("deposit", "shake"), 1.0, ""),
        (("deposit",), 1.01 * LIMIT, FALLS),
        (("deposit",), 0.99 * LIMIT, ""),
        (("deposit", "lift"), 0.0, HELD),
        (("deposit", "lift", "relax"), 0.0, HELD),
        (("deposit", "lift", "release", "relax"), 1.01 * LIMIT, FALLS),
        (("deposit", "lift", "release", "relax"), 0.99 * LIMIT, ""),
        (("deposit", "lift", "release", "relax", "shake"), 1.0, ""),
        (("deposit", "lift", "release", "lift"), 0.0, HELD),
        (("deposit", "pull-hook"), 0.0, HELD),
        (("deposit", "pull-hook", "relax"), 0.0, HELD),
        (("deposit", "lift", "pull-hook", "release", "relax"), 0.0, HELD),
        (("deposit", "tension"), 0.0, HELD),
        (("deposit", "lift", "tension", "relax"), 1.0, FALLS),
        (("deposit", "lift", "tension", "relax"), 0.0, ""),
        (("deposit", "remove-container"), 0.0, "no wall"),
    ],
)
def test_bodies_that_hang_or_fall_are_no_pile(
    recorded: Recorded, phases: tuple[str, ...], speed: float, reason: str
) -> None:
    run = recorded(phases, [(len(phases) - 1, 12, speed, 0.0)])
    frame = run.frames[0]
    assert why_no_pile(frame, run) == reason
    assert np.isnan(measure_run(run, costly="never")[PHI][0]) == bool(reason)
    assert packing_text(frame, run).startswith(f"no φ: {reason}" if reason else "φ = 0.12")


def test_a_settled_pile_keeps_its_packing_fraction_and_a_lifted_one_has_none(recorded: Recorded) -> None:
    run = recorded(("deposit", "relax", "lift"), [(1, 12, 0.0, 0.0), (2, 12, 0.0, 20 * W)])
    table, frame, made = measure_run(run, costly="never"), run.frames[0], run.manifest
    expected = packing_fraction(
        frame.vertices, radius=made.container_radius_m, solid_volume=made.solid_volume_m3, floor_z=frame.floor_z
    )
    assert table[PHI][0] == expected.value == pytest.approx(0.12)
    assert table[["phi top-percentile [-]", PHI]].iloc[1].isna().all()
    assert table["com height [m]"][1] > table["com height [m]"][0]  # heights are those of all bodies


def test_the_means_of_a_pour_are_those_of_the_settled_pile(recorded: Recorded) -> None:
    falls = [(0, 5, 0.0, 0.0), (0, 12, 1.0, W), (0, 12, 0.5, W)]
    run = recorded(("deposit", "relax"), [*falls, (0, 12, 0.001, 0.0), (0, 12, 0.0, 0.0), (1, 12, 0.5, W)])
    poured, rest = (row for _, row in summarise_run(run, costly="never").iterrows())
    assert (poured["frames averaged"], poured["smarticles [-]"]) == (2, 12)
    assert poured[PHI] == pytest.approx(0.12)
    assert poured["com height SE [m]"] == pytest.approx(0, abs=1e-12)
    assert (rest["frames averaged"], rest["smarticles [-]"]) == (1, 12)


def test_a_pour_that_has_not_settled_has_no_means(recorded: Recorded) -> None:
    run = recorded(("deposit", "relax"), [(0, 5, 0.0, 0.0), (0, 12, 1.0, W)])
    (_, row) = next(summarise_run(run).iterrows())
    assert row["frames averaged"] == 0
    assert row["time [s]"] == pytest.approx(0.1)
    assert row[[PHI, "com height [m]", "crossings mean [-]", "smarticles [-]", "phi voxel [-]"]].isna().all()
