"""Chrono beside links, without Chrono: what its driver is told, what is read of it, and what is made of that."""

from __future__ import annotations

import math
import shutil
import stat
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.chrono import __main__ as bench
from benchmarks.chrono import checks, figure
from benchmarks.chrono.cases import INTERNAL, SHAPE, Case, common, planned, scene_data, scene_of
from benchmarks.chrono.records import BARB, HEAD, LINK, Records, constraints, read_records, tilts, write_run
from benchmarks.chrono.running import alone_at, simulate
from benchmarks.chrono.table import HIGHEST, QUANTITIES, markdown, measured, summary
from benchmarks.chrono.task import PAPER, SETTINGS, barb_inertia, of_smarticle, poses, sizes, words, written
from dem.body.state import State
from dem.errors import InputError, RunError
from dem.record.manifest import read_run
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from postprocess.measures.motors import SAMPLED_WORK
from studies.framework.activity import ENERGY, HEIGHT, SAMPLED
from studies.framework.procedures import PHI

COUNT = 3
LOOK = 0.005
HEIGHTS = np.array([2e-3, 5e-3, 8e-3])
SPAN = (0.1, 0.3, 0.8, 0.2)  # s of settling, rest, activity, rest in what a driver may have written


def ready(**phase: Any) -> Scene:
    """A scene that takes over nothing, of the phases that records are of."""
    act = phase or {"type": "shape-change", "opening_s": 0.4, "closing_s": 0.4}
    phases = [{"type": "deposit"}, {"type": "relax", "duration_s": 0.3}, act, {"type": "relax", "duration_s": 0.2}]
    return parse_scene({**common("code", 1, COUNT), "phases": phases}, source="test")


def state_at(scene: Scene, lift: float, angle: float) -> State:
    """Three flat smarticles above each other, their middle links along x, a height [m] higher, barbs at an angle."""
    still = np.zeros((COUNT, 3))
    places = np.column_stack([np.zeros(COUNT), np.zeros(COUNT), HEIGHTS + lift])
    turns = np.repeat(np.eye(3)[None], COUNT, axis=0)
    return State.rigid(replace(scene.particle.boxes, angles=(angle, angle)), places, turns, still, still)


def rows(scene: Scene, *, lift: float = 1e-3, torque: float = -2e-6) -> np.ndarray[Any, Any]:
    """What a driver would have written: a pile at rest, lifted as the activity begins, whose barbs open by 1 rad."""
    ends = np.cumsum(SPAN)
    times = LOOK * np.arange(round(ends[-1] / LOOK) + 1)
    table = np.zeros((len(times), HEAD + COUNT * (3 * LINK + 2 * BARB + 1)))
    for row, time in zip(table, times, strict=True):
        phase = int(np.searchsorted(ends + 1e-9, time))
        share = min(max((time - ends[1]) / SPAN[2], 0.0), 1.0)
        angle = math.pi / 2 - (share if phase == 2 else 0.0)
        state = state_at(scene, lift if phase >= 2 else 0.0, angle)
        row[:HEAD] = time, 100 * time, 7, -1e-6, min(phase, 3)
        row[HEAD : HEAD + COUNT * 3 * LINK] = np.concatenate(
            [np.reshape(poses(state.link_positions, state.link_rotations), (-1, 7)), np.zeros((3 * COUNT, 6))], axis=1
        ).ravel()
        barb = [angle, torque, -torque * share, 0]
        row[HEAD + COUNT * 3 * LINK : -COUNT] = np.tile(barb, 2 * COUNT)
        row[-COUNT:] = 2
    return table


@pytest.fixture
def found(tmp_path: Path) -> Records:
    rows(ready()).tofile(tmp_path / "some.bin")
    return read_records(tmp_path / "some.bin", COUNT)


@pytest.fixture(scope="module")
def pile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run directory of what the driver may have written; to be read only."""
    out = tmp_path_factory.mktemp("chrono")
    rows(ready()).tofile(out / "some.bin")
    records = read_records(out / "some.bin", COUNT)
    write_run(records, ready(), out / "pile", frame_every=10, time_step=2e-4, version="test", command="test")
    return out / "pile"


def case(activity: str = SHAPE, rules: str = "code", engine: Any = "chrono", seed: int = 1) -> Case:
    return Case(engine=engine, rules=rules, activity=activity, seed=seed, count=COUNT)


def test_the_driver_is_told_the_paper_s_settings_and_both_rules(pile: Path) -> None:
    code, text = (words(scene_of(case(rules=rules), pile)) for rules in ("code", "text"))
    assert code["iterations"] == [round(50 + 1.2 * COUNT)]
    assert (code["friction"], text["friction"]) == ([0.2], [0.4])
    assert (code["radius_m"], text["radius_m"]) == ([0.0224], [0.0234])
    assert (code["law"], text["law"]) == ([2], [0])
    assert code["acceleration_limit_rad_per_s2"] == [0.0]
    inertia = barb_inertia(scene_of(case(), pile).particle.boxes)
    assert text["acceleration_limit_rad_per_s2"][0] * inertia == pytest.approx(0.5 * text["torque_limit_N_m"][0])
    assert [code[f"{name}_steps"][0] for name in ("slow", "settle", "rest")] == [500, 1500, 2500]
    assert code["steps"] == [1500 + 2500 + 15000 + 2500]
    assert code["look_steps"] == [25]
    warm = words(scene_of(case(engine="chrono-warm"), pile), SETTINGS["chrono-warm"])
    assert {name for name in warm if warm[name] != code[name]} == {"warm_start"}


def test_links_have_the_smarticle_s_mass_and_the_full_boxes(pile: Path) -> None:
    scene = scene_of(case(), pile)
    boxes, told = scene.particle.boxes, words(scene)
    assert sum(told["link_masses_kg"]) == pytest.approx(7850 * 1.27e-3 * 0.5e-3 * (0.0117 + 2 * 0.7 * 0.0117))
    assert sizes(boxes).tolist() == [
        [0.7 * 0.0117, 0.5e-3, 1.27e-3],
        [0.0117, 0.5e-3, 1.27e-3],
        [0.7 * 0.0117, 0.5e-3, 1.27e-3],
    ]
    # About its hinge a thin barb has a third of its mass times its length squared.
    assert barb_inertia(boxes) == pytest.approx(boxes.link_masses[0] * (0.7 * 0.0117) ** 2 / 3, rel=0.01)


def test_the_schedule_is_that_of_the_scene_step_by_step(pile: Path) -> None:
    targets = words(scene_of(case(), pile))["targets_rad"]
    assert len(targets) == 15000
    assert [targets[k] for k in (0, 3749, 7499, 14999)] == pytest.approx(
        [math.pi / 2 * (1 - 1 / 7500), math.pi / 4, 0.0, math.pi / 2]
    )
    swing = np.degrees(words(scene_of(case(INTERNAL), pile))["targets_rad"]) - 90
    assert (swing.min(), swing.max()) == pytest.approx((-5, 5), abs=0.1)


def test_barbs_that_do_not_all_move_alike_are_refused(pile: Path) -> None:
    data = scene_data(case(INTERNAL), pile)
    data["phases"][2]["active_fraction"] = 0.5
    with pytest.raises(InputError, match="all barbs move alike"):
        words(parse_scene(data, source="test"))


def test_times_that_are_no_whole_steps_and_other_laws_are_refused(pile: Path) -> None:
    with pytest.raises(InputError, match=r"0\.0003 s: .* 2e-4 or 5e-4"):
        words(scene_of(case(), pile), replace(PAPER, time_step=3e-4))
    data = {**scene_data(case(), pile), "motor": {"law": "slip"}}
    with pytest.raises(InputError, match=r"motor\.law: slip"):
        of_smarticle(parse_scene(data, source="test"), PAPER)


def test_poses_come_back_as_they_went(found: Records, pile: Path) -> None:
    scene = ready()
    still = np.zeros((COUNT, 3))
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    gone = State.rigid(scene.particle.boxes, np.ones((COUNT, 3)), np.repeat(turn[None], COUNT, axis=0), still, still)
    back = replace(found)
    back.links[0, ..., :7] = np.reshape(poses(gone.link_positions, gone.link_rotations), (COUNT, 3, 7))
    assert np.allclose(back.state(0, scene.particle.boxes).vertices, gone.vertices, atol=1e-12)
    told = words(scene_of(case(), pile))
    assert np.allclose(np.reshape(told["poses"], (COUNT, 3, 7))[:, 1, 2], found.links[-1, :, 1, 2])


def test_words_are_written_to_the_last_bit() -> None:
    assert written({"a": [1 / 3, np.float64(0.1)], "b": [2]}) == "a 2 0.3333333333333333 0.1\nb 1 2.0\n"


def test_records_are_read_in_the_driver_s_order_and_an_unfinished_row_is_left_out(tmp_path: Path) -> None:
    table = rows(ready())
    path = tmp_path / "part.bin"
    np.concatenate([table.ravel(), [1.0, 2.0]]).tofile(path)
    found = read_records(path, COUNT)
    assert len(found) == len(table)
    assert (found.wall[-1], found.contacts[-1], found.deepest[-1]) == (pytest.approx(140.0), 7, 1e-6)
    assert sorted(set(found.phase)) == [0, 1, 2, 3]
    assert found.neighbours.tolist()[0] == [2, 2, 2]
    assert found.barbs[-1, 2, 1].tolist() == pytest.approx([math.pi / 2, -2e-6, 2e-6, 0])
    with pytest.raises(InputError, match="those of 4 smarticles"):
        read_records(path, COUNT + 1)
    table[50] = 0.0  # as where two processes wrote
    table.tofile(path)
    with pytest.raises(InputError, match="at even times; remove it"):
        read_records(path, COUNT)


def test_a_run_is_measured_by_the_measures_of_the_studies(pile: Path) -> None:
    row = measured(case(), pile)
    assert row["h0 [m]"] == pytest.approx(5e-3)
    assert row[HEIGHT] == pytest.approx(6e-3 / 5e-3)
    assert row[HIGHEST] == pytest.approx(1.2)
    # Torque and angle go the same way: 2e-6 N m over 1 rad, both barbs of each; samples miss the first eighth.
    assert row[ENERGY] == pytest.approx(4e-6)
    assert row[SAMPLED] == pytest.approx(4e-6 * 7 / 8)
    assert row[PHI] == pytest.approx(
        3 * 1.27e-3 * 0.5e-3 * 2.4 * 0.0117 / (math.pi * 0.0234**2 * 6e-3)  # second-highest: 5 + 1 mm
    )
    assert SAMPLED_WORK.endswith("[J]")
    run = read_run(pile)
    assert (run.engine, run.status, run.versions["chrono"]) == ("chrono", "done", "test")
    assert [round(phase.end or 0, 6) for phase in run.phases] == pytest.approx(np.cumsum(SPAN).tolist())
    assert row["wall time per simulated time [s/s]"] == pytest.approx(100)


def test_hinges_that_let_barbs_out_of_the_plane_are_told(found: Records) -> None:
    scene, boxes = ready(), ready().particle.boxes
    assert tilts(found.state(0, boxes)).max() < 1e-6
    assert constraints(found, scene, 10)["largest_tilt_rad"] < 1e-6
    turn = Rotation.from_rotvec([0.0, 0.3, 0.0])  # about the barbs, which point along y
    last = int(np.flatnonzero(found.phase == 2)[0])
    for barb in (0, 2):
        links = found.links[last, 1, barb]
        links[3:7] = (turn * Rotation.from_quat(links[[4, 5, 6, 3]])).as_quat()[[3, 0, 1, 2]]
    assert tilts(found.state(last, boxes))[1] == pytest.approx([0.3, 0.3])
    told = constraints(found, scene, 10)
    looks = len(np.flatnonzero(found.phase == 2)[::10])
    assert told["largest_tilt_rad"] == pytest.approx(0.3)
    assert told["mean_tilt_rad"] == pytest.approx(0.3 / COUNT / looks, rel=1e-6)
    assert told["greatest_torque_over_limit"] == pytest.approx(2e-6 / scene.torque_limit)
    assert (told["over_limit_share"], told["deepest_m"]) == (0.0, 1e-6)


def test_what_tells_most_comes_first() -> None:
    order = [one.name for one in planned("chrono", [1, 2], ["internal30", INTERNAL, SHAPE], 100)]
    assert order[:4] == [
        f"chrono-{kind}-100-1" for kind in ("internal10-code", "internal10-text", "shape-code", "shape-text")
    ]
    assert order[7:9] == ["chrono-shape-text-100-2", "chrono-internal30-code-100-1"]
    assert len(order) == 12


def program(path: Path, text: str) -> Path:
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_what_was_simulated_is_not_simulated_again_unless_the_task_is_another(tmp_path: Path) -> None:
    rows(ready()).tofile(tmp_path / "given.bin")
    driver = program(tmp_path / "driver", f'echo ran >> {tmp_path}/calls; cp {tmp_path}/given.bin "$2"')
    for told in ({"a": [1.0]}, {"a": [1.0]}, {"a": [2.0]}):
        simulate(driver, tmp_path, "some", told, COUNT)
    assert (tmp_path / "calls").read_text(encoding="utf-8").split() == ["ran", "ran"]


def test_two_processes_do_not_write_the_same_records(tmp_path: Path) -> None:
    with (
        alone_at(tmp_path / "some.lock"),
        pytest.raises(InputError, match="some: another process simulates it; wait"),
    ):
        simulate(tmp_path / "driver", tmp_path, "some", {"a": [1.0]}, COUNT)


def test_a_driver_that_is_not_there_or_fails_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--driver .*nowhere: no such program"):
        simulate(tmp_path / "nowhere", tmp_path, "some", {"a": [1.0]}, COUNT)
    driver = program(tmp_path / "driver", "echo driver: the task lacks law; exit 3")
    with pytest.raises(RunError, match="status 3: driver: the task lacks law"):
        simulate(driver, tmp_path, "some", {"a": [1.0]}, COUNT)


def test_one_seed_has_no_error_and_more_have_one() -> None:
    values = dict.fromkeys(QUANTITIES, 1.0)
    one = {"activity": SHAPE, "rules": "text", "engine": "chrono", "seed": 1, **values}
    others = [{**one, "engine": "links", "seed": seed, HEIGHT: height} for seed, height in ((1, 1.0), (2, 1.2))]
    table = summary(pd.DataFrame([*others, one, {**one, "rules": "code"}]))
    assert table[["rules", "engine", "seeds"]].to_numpy().tolist() == [
        ["code", "chrono", 1], ["text", "chrono", 1], ["text", "links", 2]
    ]  # fmt: skip
    lines = markdown(table).splitlines()
    assert lines[2].startswith("| shape | code | chrono | 1 | 1.000 | 1.000 |")
    assert lines[4].startswith("| shape | text | links | 2 | 1.100 ± 0.100 | 1.000 ± 0.000 |")


def test_the_figure_says_how_many_runs_it_shows(tmp_path: Path, pile: Path) -> None:
    shutil.copytree(pile, tmp_path / case().name)
    assert figure.draw(tmp_path / "heights", tmp_path, [case()]) == [tmp_path / "heights.png"]
    said = " ".join(figure.footer([case(), case(seed=2), case(rules="text")]))
    assert "Chrono, shape, by the code: n = 2" in said
    assert "links, shape, by the code: n = 0" in said
    time = np.arange(0, 1, LOOK)
    assert np.allclose(np.subtract(*figure.smooth(time, 1 + time)), -1)


def test_the_known_answers_are_of_level_barbs_on_an_upright_middle_link() -> None:
    told = checks.task(checks.alone("code"), [1.0], gravity=9.81)
    centres = np.reshape(told["poses"], (3, 7))[:, :3]
    assert np.ptp(centres[[0, 2], 2]) == pytest.approx(0.0117)
    assert centres[0, 2] < centres[1, 2] < centres[2, 2]
    assert (told["held"], told["wall_height_m"]) == ([1], [0.0])


def test_the_command_ends_with_2_where_there_is_no_driver(
    tmp_path: Path, pile: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, "pour", lambda *_: pile)
    given = ["chrono", "--out", str(tmp_path), "--driver", str(tmp_path / "nowhere"), "--count", str(COUNT)]
    monkeypatch.setattr("sys.argv", [*given, "--links-seeds", "--seeds", "1"])
    assert bench.main() == 2
    assert "no such program" in capsys.readouterr().err


def test_what_is_done_becomes_the_table_and_is_not_measured_again(
    tmp_path: Path, pile: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(pile, tmp_path / case().name)
    given = ["chrono", "--out", str(tmp_path), "--analyse", "--count", str(COUNT), "--links-seeds"]
    monkeypatch.setattr("sys.argv", given)
    assert bench.main() == 0
    table = pd.read_csv(tmp_path / "runs.csv")
    assert table["run"].tolist() == [case().name]
    assert (tmp_path / "table.md").read_text(encoding="utf-8").count("\n") == 3
    monkeypatch.setattr(bench, "measured", lambda *_: pytest.fail("measured again"))
    assert bench.main() == 0
