import json

import pytest

from dem.errors import InputError
from postprocess import read_run

DONE = {
    "status": "done",
    "time_s": 21.0,
    "steps": 100,
    "wall_s": 9.5,
    "phases": [
        {"index": i, "type": kind, "start_s": i, "end_s": i + 1, "wall_s": 2.0}
        for i, kind in enumerate(["deposit", "relax", "shake", "relax"])
    ],
}


def edit(directory, **changes):
    path = directory / "run.json"
    data = json.loads(path.read_text()) | changes
    path.write_text(json.dumps({key: value for key, value in data.items() if value is not None}))


def test_unfinished_run(run):
    manifest = read_run(run)
    assert manifest.status == "unfinished"
    assert manifest.end_time is None
    assert (manifest.name, manifest.seed, manifest.count) == ("pile", 7, 6)
    assert manifest.thickness_in_plane == 0.5e-3
    assert [phase.type for phase in manifest.phases] == ["deposit", "relax", "shake", "relax"]
    assert manifest.versions["yade"] == "2023.02a"


def test_done_run(make_run):
    manifest = read_run(make_run(ending=("done.json", DONE)))
    assert (manifest.status, manifest.end_time, manifest.steps) == ("done", 21.0, 100)
    assert (manifest.phases[2].start, manifest.phases[2].end) == (2.0, 3.0)


def test_failed_run(make_run):
    failed = {"status": "interrupted", "cause": "out of disk", "time_s": 3.0}
    manifest = read_run(make_run(ending=("failed.json", failed)))
    assert (manifest.status, manifest.cause) == ("interrupted", "out of disk")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": None}, "key 'seed' is missing"),
        ({"seed": True}, "'seed' must be a whole number"),
        ({"count": 0}, "'count' must be a whole number, 1 or more: got 0"),
        ({"container_radius_m": -1}, "'container_radius_m' must be a finite number > 0: got -1"),
        ({"solid_volume_m3": float("nan")}, "'solid_volume_m3' must be a finite number > 0"),
        ({"time_step_s": 0}, "'time_step_s' must be a finite number > 0: got 0"),
        ({"time_step_s": "1"}, "'time_step_s' must be a finite number > 0: got '1'"),
        ({"name": 3}, "'name' must be text"),
        ({"format": 2}, "'format' must be 1: got 2"),
        ({"phases": 3}, "'phases' must be a list"),
        ({"phases": [{"index": 1, "type": "relax"}]}, "numbered"),
        ({"versions": 3}, "'versions' must be an object"),
    ],
)
def test_bad_manifest(run, changes, message):
    edit(run, **changes)
    with pytest.raises(InputError, match=message) as error:
        read_run(run)
    assert "\n" not in str(error.value)
    assert "run.json" in str(error.value)


@pytest.mark.parametrize("text", ["", '{"format": 1, "na', "[]", "\x80"])
def test_truncated_manifest(run, text):
    (run / "run.json").write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match=r"cannot read manifest .*run\.json") as error:
        read_run(run)
    assert "\n" not in str(error.value)


def test_missing_directory_and_manifest(tmp_path):
    with pytest.raises(InputError, match="no such directory"):
        read_run(tmp_path / "none")
    with pytest.raises(InputError, match=r"it holds no run\.json; give the directory of a run"):
        read_run(tmp_path)
    (tmp_path / "sweep.json").write_text("{}")
    with pytest.raises(InputError, match=r"it is a sweep; give one of its runs, .*/runs/NAME"):
        read_run(tmp_path)
    with pytest.raises(InputError, match=r"sweep\.json: it is a file; give the directory of a run"):
        read_run(tmp_path / "sweep.json")


def test_ending_that_belongs_to_another_run(make_run):
    other = DONE | {"phases": DONE["phases"][:2]}
    with pytest.raises(InputError, match="phases differ"):
        read_run(make_run(ending=("done.json", other)))
