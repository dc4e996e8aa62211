"""`smarticles doctor` without YADE: what it concludes from what it finds."""

import shutil
from pathlib import Path

import pytest
from command_cases import Smarticles

from dem.engine.links import cache
from dem.run import warm
from smarticles.commands import doctor

Answers = dict[str, tuple[bool, str]]


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> Answers:
    """Answers of the processes that try a part, by script; a version where a test gives none."""
    answers: Answers = {}
    monkeypatch.setattr(doctor, "_run_script", lambda script: answers.get(script, (True, "1.2")))
    monkeypatch.setattr(shutil, "which", lambda command: None)
    return answers


def test_a_machine_without_slurm_is_fit_for_runs(answers: Answers, smarticles: Smarticles) -> None:
    said = smarticles("doctor")
    assert said.status == 0
    assert said.out.endswith("everything that a run needs works\n")
    assert "yade            ok    1.2\n" in said.out
    assert "slurm           no    no sbatch\n" in said.out
    assert "way out: only `sweep --submit slurm` needs it" in said.out


def test_compile_says_what_was_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, smarticles: Smarticles
) -> None:
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    monkeypatch.setattr(warm, "compile_for", lambda scene: (tmp_path / f"{scene.name}.code").touch())
    said = smarticles("doctor", "--compile")
    assert said.status == 0
    kinds = said.out.splitlines()
    assert [line.split("  ")[0] for line in kinds[:-1]] == [kind for kind, _, _ in doctor._COMPILED]
    assert "1 kernels compiled in " in kinds[0]
    assert "was compiled before" in kinds[2]  # another scene of that name
    assert kinds[-1].endswith(f" are stored in {tmp_path}")
    assert smarticles("doctor", "--compile", "--json").status == 2
    monkeypatch.setattr(cache, "folder", lambda: None)
    assert smarticles("doctor", "--compile").status == 1


@pytest.mark.parametrize(
    ("broken", "status", "lines"),
    [
        (["_YADE"], 0, ["yade            no    gone", "scenes with `engine: links` run without it"]),
        (
            ["_YADE", "_LINKS"],
            1,
            ["yade            FAILS gone", "links           no    gone", "runs need these, which fail: yade\n"],
        ),
        (["_PYVISTA"], 0, ["pyvista         no    gone", "only pictures need it", "pip install 'smarticles[viz]'"]),
        (["_LAMMPS"], 0, ["lammps          no    gone", "only scenes with `engine: lammps` need it"]),
    ],
)
def test_what_fails_has_a_way_out(
    broken: list[str], status: int, lines: list[str], answers: Answers, smarticles: Smarticles
) -> None:
    answers |= {getattr(doctor, name): (False, "gone") for name in broken}
    said = smarticles("doctor")
    assert said.status == status
    for line in lines:
        assert line in said.out


def test_disk_is_tried_and_left_clean(tmp_path: Path) -> None:
    ok, found = doctor.disk(Path("/proc"))  # no new files there, not even by root
    assert not ok
    assert "in /proc, cannot be written: " in found
    assert doctor.disk(tmp_path)[0]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("script", "answer"),
    [
        ("print('banner'); print('3')", (True, "3")),
        ("import no_such_module", (False, "ModuleNotFoundError: No module named 'no_such_module'")),
        ("import os; os.abort()", (False, "killed by SIGABRT")),
        ("raise SystemExit(3)", (False, "exit status 3")),
        ("raise SystemExit('an empty picture')", (False, "an empty picture")),
    ],
)
def test_child_process(script: str, answer: tuple[bool, str]) -> None:
    assert doctor._run_script(script) == answer


def test_child_process_that_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_TIMEOUT_S", 0.2)
    assert doctor._run_script("import time; time.sleep(60)") == (False, "no answer within 0.2 s")


@pytest.mark.parametrize("script", [doctor._LINKS, doctor._PYVISTA])
def test_the_scripts_work_here(script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    ok, found = doctor._run_script(script)
    assert ok, found
