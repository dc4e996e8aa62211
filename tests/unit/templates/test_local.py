"""The local runner, with a fake run in place of the simulation."""

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import pytest
from sweep_cases import MakeFolder
from synthetic import write_ended

from dem.errors import InputError
from templates.local import Outcome, RunCommand, Snapshot, run_folder
from templates.sweep.folder import Folder

FAKE = Path(__file__).with_name("fake_run.py")
QUICK = {"poll_s": 0.01, "grace_s": 300.0}


@dataclass
class Watcher:
    """A display that remembers, and may interrupt."""

    when: Callable[[Snapshot], bool] = lambda _: False
    starts: list[str] = field(default_factory=list)
    ends: list[Outcome] = field(default_factory=list)
    snapshots: list[Snapshot] = field(default_factory=list)
    stops: list[int] = field(default_factory=list)
    open: bool = False

    def __enter__(self) -> Self:
        self.open = True
        return self

    def __exit__(self, *exception: object) -> None:
        self.open = False

    def started(self, name: str) -> None:
        self.starts.append(name)

    def ended(self, outcome: Outcome) -> None:
        self.ends.append(outcome)

    def update(self, snapshot: Snapshot) -> None:
        self.snapshots.append(snapshot)
        if self.when(snapshot):
            raise KeyboardInterrupt

    def stopping(self, count: int) -> None:
        self.stops.append(count)


def fake(behaviours: dict[str, str] | None = None) -> RunCommand:
    """The command of a run; `behaviours` by its name, `ok` for those not named."""

    def command(scene: Path, directory: Path, resume: bool) -> Sequence[str]:
        behaviour = (behaviours or {}).get(directory.name, "ok")
        # The fake has no scene model to compute a hash with.
        words = (sys.executable, "-I", "-S", str(FAKE), behaviour, str(scene), str(directory))
        return (*words, "--resume") if resume else words

    return command


@pytest.fixture
def folder(make_folder: MakeFolder) -> Folder:
    """Runs n10_seed1, n10_seed2, n20_seed1, n20_seed2; their scenes name their hashes."""
    made = make_folder()
    for entry in made.entries:
        scene = made.scene(entry)
        scene.write_text(f"{scene.read_text()}\n# sha256 {entry.scene_sha256}\n")
    return made


def is_free(folder: Folder) -> bool:
    with folder.lock():
        return True


def statuses(outcomes: Sequence[Outcome]) -> list[str]:
    return [outcome.status for outcome in outcomes]


def test_all_runs_run_once_with_one_thread_the_longest_first(folder: Folder) -> None:
    watcher = Watcher()
    outcomes = run_folder(folder, watcher, slots=1, command=fake(), **QUICK)
    assert statuses(outcomes) == ["done"] * 4
    assert [outcome.name for outcome in outcomes] == [entry.name for entry in folder.entries]
    assert watcher.starts == ["n20_seed1", "n20_seed2", "n10_seed1", "n10_seed2"]
    assert not watcher.open
    assert watcher.stops == []
    for entry in folder.entries:
        assert (folder.run(entry) / "threads").read_text() == "1"
        # A run that outlives its runner keeps the sweep locked.
        assert (folder.run(entry) / "held").read_text() == str(folder.path / ".lock")
    last = watcher.snapshots[-1]
    assert (last.total, last.ended, last.failed, last.running) == (4, 4, 0, ())
    assert last.left_s == 0


@pytest.mark.parametrize("slots", [1, 3])
def test_as_many_runs_as_slots_and_never_more(folder: Folder, slots: int) -> None:
    waiting = fake({entry.name: "wait" for entry in folder.entries})
    watcher = Watcher(when=lambda now: sum(said.phi is not None for *_, said in now.running) == slots)
    with pytest.raises(KeyboardInterrupt):
        run_folder(folder, watcher, slots=slots, command=waiting, **QUICK)
    assert max(len(snapshot.running) for snapshot in watcher.snapshots) == slots
    assert len(watcher.starts) == slots


def test_a_failing_run_does_not_stop_the_others(folder: Folder) -> None:
    behaviours = {"n20_seed1": "fail", "n10_seed1": "crash", "n10_seed2": "reject", "n20_seed2": "silent"}
    outcomes = run_folder(folder, Watcher(), slots=2, command=fake(behaviours), **QUICK)
    assert statuses(outcomes) == ["failed"] * 4
    assert [outcome.cause for outcome in outcomes] == [
        "killed by SIGKILL (out of memory?): Segmentation something",
        "scene.yaml: count: -1 is negative; use 1",
        "left through the wall",
        f"ended without done.json, without output; see {folder.log(folder.entries[3])}",
    ]


def test_a_second_start_keeps_finished_runs_and_sets_others_aside(folder: Folder) -> None:
    first = run_folder(folder, Watcher(), command=fake({"n20_seed1": "fail"}), **QUICK)
    assert statuses(first) == ["done", "done", "failed", "done"]
    ids = [(folder.run(entry) / "id").read_text() for entry in folder.entries]
    failed = folder.entries[2]
    (folder.run(failed) / "precious").write_text("data")

    watcher = Watcher()
    second = run_folder(folder, watcher, command=fake(), **QUICK)
    assert statuses(second) == ["kept", "kept", "done", "kept"]
    assert watcher.starts == ["n20_seed1"]
    again = [(folder.run(entry) / "id").read_text() for entry in folder.entries]
    assert [old == new for old, new in zip(ids, again, strict=True)] == [True, True, False, True]
    aside = folder.path / "runs" / "n20_seed1.stopped-1"
    assert (aside / "precious").read_text() == "data"
    assert (aside / "id").read_text() == ids[2]

    third = run_folder(folder, Watcher(), command=fake(), **QUICK)
    assert statuses(third) == ["kept"] * 4


def test_ctrl_c_stops_all_runs_and_leaves_usable_directories(folder: Folder) -> None:
    waiting = {"n20_seed1": "wait", "n20_seed2": "wait"}
    watcher = Watcher(when=lambda now: sum(said.phi is not None for *_, said in now.running) == 2)
    with pytest.raises(KeyboardInterrupt):
        run_folder(folder, watcher, slots=2, command=fake(waiting), **QUICK)
    assert sorted(watcher.starts) == ["n20_seed1", "n20_seed2"]  # two threads, in either order
    assert watcher.stops == [2]
    assert sorted(statuses(watcher.ends)) == ["interrupted", "interrupted"]
    assert not watcher.open
    states = {status.name: status.state for status in folder.status()}
    assert states == {
        "n10_seed1": "missing",
        "n10_seed2": "missing",
        "n20_seed1": "interrupted",
        "n20_seed2": "interrupted",
    }
    assert is_free(folder)
    # Nothing was set aside that was not run anew.
    assert not list((folder.path / "runs").glob("*.stopped-*"))
    outcomes = run_folder(folder, Watcher(), command=fake(), **QUICK)
    assert statuses(outcomes) == ["done"] * 4


@pytest.mark.parametrize(
    ("state", "checkpoint", "goes_on"),
    [("interrupted", True, True), ("interrupted", False, False), ("failed", True, False)],
)
def test_stopped_runs_go_on_from_their_checkpoint(folder: Folder, state: str, checkpoint: bool, goes_on: bool) -> None:
    entry = folder.entries[0]
    run = folder.run(entry)
    write_ended(run, entry.scene_sha256, status=state)
    (run / "precious").write_text("data")
    if checkpoint:
        (run / "checkpoint.zip").write_text("")
    outcomes = run_folder(folder, Watcher(), slots=4, command=fake(), **QUICK)
    assert statuses(outcomes) == ["done"] * 4
    aside = run.with_name("n10_seed1.stopped-1")
    assert (run / "precious").exists() is goes_on
    assert aside.exists() is not goes_on


def test_a_run_that_does_not_listen_is_made_to_stop(folder: Folder) -> None:
    deaf = fake({"n20_seed1": "deaf"})
    progress = folder.run(folder.entries[2]) / "progress.json"
    watcher = Watcher(when=lambda _: progress.exists())
    with pytest.raises(KeyboardInterrupt):
        run_folder(folder, watcher, slots=1, command=deaf, poll_s=0.01, grace_s=1.0)
    assert [outcome.cause for outcome in watcher.ends] == ["killed by SIGTERM, without output; see "
        f"{folder.log(folder.entries[2])}"]  # fmt: skip
    assert is_free(folder)


def test_a_display_that_fails_leaves_no_process_behind(folder: Folder) -> None:
    class Broken(Watcher):
        def update(self, snapshot: Snapshot) -> None:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_folder(folder, Broken(), command=fake({"n20_seed1": "wait"}), **QUICK)
    assert is_free(folder)


def test_progress_of_all_runs_reaches_the_display(folder: Folder) -> None:
    watcher = Watcher(when=lambda now: any(said.phi is not None for *_, said in now.running))
    with pytest.raises(KeyboardInterrupt):
        run_folder(folder, watcher, slots=1, command=fake({"n20_seed1": "wait"}), **QUICK)
    ((name, wall_s, said),) = watcher.snapshots[-1].running
    assert (name, said.phase, said.time_s, said.end_s, said.phi) == ("n20_seed1", "shake", 1.25, 5.5, 0.123)
    # 20 s expected of this run, less what has passed, then 20 + 10 + 10 s of the others.
    assert watcher.snapshots[-1].left_s == pytest.approx(20 - wall_s + 40)


def test_two_runners_do_not_share_a_sweep(folder: Folder) -> None:
    with folder.lock(), pytest.raises(InputError, match="are being computed already"):
        run_folder(folder, Watcher(), command=fake(), **QUICK)
    assert not (folder.path / "runs").exists()


def test_runs_get_their_places_from_the_sweeps_directory(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    places: list[tuple[str, str]] = []

    def noting(scene: Path, directory: Path, resume: bool) -> Sequence[str]:
        places.append((str(scene), str(directory)))
        return fake()(scene, directory, resume)

    # What the user gave for imports still means what it meant where it was given.
    monkeypatch.setenv("PYTHONPATH", f"lib{os.pathsep}{folder.path}")
    outcomes = run_folder(folder, Watcher(), command=noting, **QUICK)
    assert sorted(places) == sorted((f"scenes/{entry.name}.yaml", f"runs/{entry.name}") for entry in folder.entries)
    assert [outcome.cause for outcome in outcomes] == [None] * 4
    assert all(folder.is_done(entry) for entry in folder.entries)
    searched = (folder.run(folder.entries[0]) / "searched").read_text().split(os.pathsep)
    assert searched[-2:] == [str(Path.cwd() / "lib"), str(folder.path)]
