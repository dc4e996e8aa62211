import json

import pytest

from dem.errors import InputError
from dem.record.run import open_run

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


def test_phases_of_a_done_run_have_times_and_time_steps(make_run):
    phase = open_run(make_run(ending=("done.json", DONE))).phases[2]
    assert (phase.type, phase.start_s, phase.end_s, phase.cpu_s, phase.time_step_s) == ("shake", 2.0, 3.0, None, 1e-5)


def test_what_manifests_of_older_versions_lack(run):
    edit(run, engine=None, container_tiers=None, planar=None, versions={"links": "3"}, newer_key=1)
    manifest = open_run(run).manifest
    assert (manifest.engine, manifest.container_tiers, manifest.planar) == ("links", 1, False)


def test_a_manifest_of_an_older_version_describes_one_start(run):
    edit(run, machine=None, resumed=None, versions={"smarticles": "0.1", "yade": "1"}, threads=2)
    manifest = open_run(run).manifest
    (start,) = manifest.starts
    assert (start.started, start.command, start.machine) == (manifest.started, manifest.command, None)
    assert manifest.made_by == {"smarticles": "0.1", "yade": "1"}
    assert manifest.made_on == {"threads": "2"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"resumed": [{"started": "now"}]}, "resumed.0.command: Field required"),
        ({"seed": None}, "seed: Field required;"),
        ({"solid_volume_m3": float("nan")}, "solid_volume_m3: .* finite number, got nan"),
        ({"name": 3}, "name: .* string, got 3"),
        ({"format": 2}, "format: .* 1, got 2"),
        ({"phases": [{"index": 1, "type": "relax"}]}, "numbered"),
    ],
)
def test_bad_manifest(run, changes, message):
    edit(run, **changes)
    with pytest.raises(InputError, match=message) as error:
        open_run(run)
    assert "\n" not in str(error.value)
    assert "run.json" in str(error.value)


@pytest.mark.parametrize("text", ["", '{"format": 1, "na', "[]", "\x80"])
def test_truncated_manifest(run, text):
    (run / "run.json").write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match=r"cannot read manifest .*run\.json") as error:
        open_run(run)
    assert "\n" not in str(error.value)


def test_missing_directory_and_manifest(tmp_path):
    with pytest.raises(InputError, match="no such directory"):
        open_run(tmp_path / "none")
    with pytest.raises(InputError, match=r"it holds no run\.json; give the directory of a run"):
        open_run(tmp_path)
    (tmp_path / "sweep.json").write_text("{}")
    with pytest.raises(InputError, match=r"it is a sweep; give one of its runs, .*/runs/NAME"):
        open_run(tmp_path)
    with pytest.raises(InputError, match=r"sweep\.json: it is a file; give the directory of a run"):
        open_run(tmp_path / "sweep.json")


def test_ending_that_belongs_to_another_run(make_run):
    other = DONE | {"phases": DONE["phases"][:2]}
    with pytest.raises(InputError, match="phases differ"):
        _ = open_run(make_run(ending=("done.json", other))).phases
