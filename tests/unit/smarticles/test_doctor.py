"""`smarticles doctor` without YADE: what it concludes from what it finds."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from smarticles import installation

YADE = {"version": "2023.02a", "path": "/somewhere/yade", "speed": 0.0981}
LINKS = {"version": "0.68.1", "sum": 3, "folder": "/somewhere/links"}
LAMMPS = {"version": installation.LAMMPS_TRIED, "obeyed": True}
PYVISTA = {"version": "0.49", "vtk": "9.7.2", "window": "vtkEGLRenderWindow", "contrast": 50.0}


@pytest.fixture
def answers(monkeypatch):
    """What child processes answer; without an entry: a version. To be changed by a test."""
    answers = {
        installation._YADE: YADE,
        installation._LAMMPS: LAMMPS,
        installation._LINKS: LINKS,
        installation._PYVISTA: PYVISTA,
    }
    monkeypatch.setattr(installation, "_ask", lambda script: answers.get(script, {"version": "1.2"}))
    monkeypatch.setattr(shutil, "which", lambda command: None)
    return answers


def test_machine_without_slurm_is_fit_for_runs(answers, capsys):
    assert installation.doctor(json_output=False) == 0
    output = capsys.readouterr().out
    assert output.endswith("everything that a run needs works\n")
    assert "yade            ok    2023.02a, /somewhere/yade; a sphere falls\n" in output
    assert "slurm           no    no sbatch\n" in output
    assert "way out: only `sweep --submit slurm` needs it" in output


def test_json_holds_every_check(answers, capsys):
    assert installation.doctor(json_output=True) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["ok"] is True
    by_name = {check["name"]: check for check in report["checks"]}
    assert {"python", "yade", "numpy", "pyvista", "slurm", "memory", "disk"} <= set(by_name)
    assert by_name["slurm"] == {
        "name": "slurm",
        "ok": False,
        "needed": False,
        "found": "no sbatch",
        "way_out": by_name["slurm"]["way_out"],
    }


def test_without_yade_scenes_on_links_run(answers, capsys):
    answers[installation._YADE] = "RunError: YADE cannot be imported"
    assert installation.doctor(json_output=False) == 0
    output = capsys.readouterr().out
    assert "yade            no    RunError: YADE cannot be imported\n" in output
    assert "scenes with `engine: links` run without it" in output
    assert "links           ok    Numba 0.68.1; compiled code in /somewhere/links\n" in output


def test_without_any_engine_nothing_runs(answers, capsys):
    answers[installation._YADE] = "RunError: YADE cannot be imported"
    answers[installation._LINKS] = {**LINKS, "sum": 0}
    assert installation.doctor(json_output=False) == 1
    output = capsys.readouterr().out
    assert output.endswith("a run needs what fails here: yade\n")
    assert "links           no    Numba computes nonsense\n" in output
    assert "way out: `make setup` installs it" in output


def test_without_pictures_runs_go_on(answers, capsys):
    answers[installation._PYVISTA] = "killed by SIGSEGV"
    assert installation.doctor(json_output=False) == 0
    assert "pyvista         no    killed by SIGSEGV\n" in capsys.readouterr().out


def test_yade_that_computes_nothing_fails(answers):
    answers[installation._YADE] = {**YADE, "speed": 0.0}
    check = installation.check_yade()
    assert not check.ok
    assert "falls at 0 m/s after 0.01 s" in check.found


def test_empty_picture_fails(answers):
    answers[installation._PYVISTA] = {**PYVISTA, "contrast": 0.0}
    check = installation.check_pyvista()
    assert not check.ok
    assert check.found == "vtkEGLRenderWindow draws an empty picture"


def test_every_failure_names_a_way_out(answers, monkeypatch):
    monkeypatch.setattr(installation, "_ask", lambda script: "ImportError: gone")
    monkeypatch.setattr(installation, "_LEAST_MEMORY_GIB", 1e6)
    monkeypatch.setattr(installation, "_LEAST_DISK_GIB", 1e6)
    checks = list(installation.examine())
    assert {check.name for check in checks if check.ok} == {"python", "cores"}
    assert all(check.way_out for check in checks if not check.ok)


def test_unwritable_folder(answers):
    check = installation.check_disk(Path("/proc"))  # refuses new files to root, too
    assert not check.ok
    assert "in /proc, cannot be written: " in check.found


def test_disk_check_leaves_nothing(answers, tmp_path):
    assert installation.check_disk(tmp_path).ok
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("controller_answers", [True, False])
def test_slurm_is_asked_whether_it_answers(monkeypatch, controller_answers):
    def output(*command):
        if command == ("scontrol", "ping") and not controller_answers:
            raise subprocess.CalledProcessError(1, command)
        return "slurm 22.05"

    monkeypatch.setattr(shutil, "which", lambda command: f"/usr/bin/{command}")
    monkeypatch.setattr(installation, "_output", output)
    check = installation.check_slurm()
    assert check.ok is controller_answers
    assert check.found.startswith("slurm 22.05, its controller ")


@pytest.mark.parametrize(
    ("script", "answer"),
    [
        ("print('banner'); print('{\"version\": \"3\"}')", {"version": "3"}),
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("import os; os.abort()", "killed by SIGABRT"),
        ("raise SystemExit(3)", "exit status 3"),
    ],
)
def test_child_process(script, answer):
    assert installation._ask(script) == answer


def test_child_process_that_hangs(monkeypatch):
    monkeypatch.setattr(installation, "_TIMEOUT_S", 0.2)
    assert installation._ask("import time; time.sleep(60)") == "no answer within 0.2 s"


def test_version_of_an_installed_package():
    check = installation.check_package("packaging", "packaging", needed=True)
    assert check.ok
    assert check.found[0].isdigit()


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (LAMMPS, "lammps          ok    29 Sep 2021 - Update 2, under mpirun\n"),
        ({**LAMMPS, "version": "2 Aug 2023"}, "ok    2 Aug 2023, under mpirun; the engine was tried with 29 Sep 2021"),
        ({**LAMMPS, "obeyed": False}, "no    29 Sep 2021 - Update 2 does not do what it is told\n"),
        ("RunError: engine: lammps needs the program lmp", "no    RunError: engine: lammps needs the program lmp\n"),
    ],
)
def test_lammps_is_told_of_and_not_needed(answers, capsys, answer, told):
    answers[installation._LAMMPS] = answer
    assert installation.doctor(json_output=False) == 0
    output = capsys.readouterr().out
    assert told in output
    assert ("way out: only scenes with `engine: lammps` need it; `make setup-mpi` installs it" in output) == (
        "lammps          no" in output
    )
