"""LAMMPS that is missing or ends: cause and way out in one line, and nothing written."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from scenes import small

from dem.engine.lammps.child import NEEDED, Child, explain
from dem.errors import RunError
from dem.run.run import run_scene

HELP = "Large-scale Atomic/Molecular Massively Parallel Simulator - {version}\n\n" + " ".join(NEEDED)
Programs = Callable[..., Path]


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Programs:
    """Makes programs that are all that is found; each a shell script."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))

    def make(**scripts: str) -> Path:
        for name, text in scripts.items():
            (folder / name).write_text(f"#!/bin/sh\n{text}\n")
            (folder / name).chmod(0o755)
        return folder

    return make


def said(version: str = "29 Sep 2021", *, without: str = "") -> str:
    text = HELP.format(version=version).replace(without, "") if without else HELP.format(version=version)
    return f"while read -r line; do echo \"$line\"; done <<'E'\n{text}\nE"


@pytest.mark.parametrize(("there", "missing"), [({}, "lmp of LAMMPS"), ({"lmp": said()}, "mpirun of Open MPI")])
def test_what_is_missing_is_named_and_no_directory_is_left(
    programs: Programs, there: dict[str, str], missing: str, tmp_path: Path
) -> None:
    programs(**there)
    way_out = r"`make setup-mpi` or `apt-get install lammps openmpi-bin`, or use engine: yade"
    with pytest.raises(RunError, match=rf"^engine: lammps needs the program {missing}, .*; install it with {way_out}"):
        run_scene(small({"engine": "lammps"}), tmp_path / "run", command="test", progress=False)
    assert not (tmp_path / "run").exists()


KILLED = """\
--------------------------------------------------------------------------
mpirun noticed that process rank 1 with PID 0 on node box exited on
signal 9 (Killed).
--------------------------------------------------------------------------
"""
UNKNOWN = "ERROR: Unknown fix style nonsense (../modify.cpp:899)\nLast command: fix bogus all   nonsense\n"


@pytest.mark.parametrize(
    ("log", "printed", "cause", "way_out"),
    [
        ("", KILLED, "rank 1 was ended by signal 9 (Killed)", "if memory ran out.*fewer --ranks; go on .*resume"),
        ("", KILLED.replace("9 (Killed)", "11 (Segmentation fault)"), "signal 11 (Segm", "^go on from the last check"),
        (UNKNOWN, "", "Unknown fix style nonsense (command: fix bogus all nonsense)", "does not know .*setup-mpi"),
        ("ERROR: Lost atoms: original 180 (../thermo.cpp:438)", "", "Lost atoms: original", "fly apart.*low"),
        ("", "ERROR on proc 1: Failed to allocate 8 bytes for array x (../memory.cpp:66)", "Failed", "memory is short"),
        ("", "There are not enough slots available in the system", "fewer cores than ranks", "fewer --ranks"),
        ("units si", "", "exit status 3 (it says nothing)", "see its log"),
    ],
)
def test_why_it_ended_is_read_from_its_own_log(log: str, printed: str, cause: str, way_out: str) -> None:
    found = explain(log, printed, 3)
    assert cause in found[0]
    assert "cpp" not in found[0]
    assert re.search(way_out, found[1])


def test_the_error_of_a_child_that_ends_names_its_log_and_its_folder_is_gone(
    programs: Programs, tmp_path: Path
) -> None:
    echo = "\n".join(f"echo '{line}'" for line in KILLED.splitlines())
    programs(mpirun=f"read -r line\n{echo}\nexit 137")
    child = Child(2)
    with pytest.raises(
        RunError, match=r"^LAMMPS ended: rank 1 was ended by signal 9 \(Killed\); .*; its log: /"
    ) as error:
        child.send("run 1")
    assert not child.scratch.exists()
    kept = Path(str(error.value).rpartition("its log: ")[2])
    assert "signal 9 (Killed)" in kept.read_text()
    kept.unlink()
    kept.parent.rmdir()
