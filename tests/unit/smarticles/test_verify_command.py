"""`smarticles verify` without YADE: the computing process is stood in for."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from command_cases import Smarticles

from smarticles.commands import verify as commands_verify


class Child:
    """Stands in for the computing process; writes what it is told to."""

    def __init__(self, status: int, stderr: str, ok: bool) -> None:
        self.status, self.stderr, self.ok, self.command = status, stderr, ok, [""]

    def run(self, command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        self.command, folder = command, Path(command[-1])
        if not self.status:
            check = {"case": "fall", "quantity": "way", "unit": "m", "theory [unit]": 1.0, "measured [unit]": 1.0}
            check |= {"error [1]": 0.0, "tolerance [1]": 0.1, "ok": self.ok}
            pd.DataFrame([check]).to_csv(folder / "verification.csv", index=False)
            rows = [
                {"ladder": "fall", "quantity": "way", "unit": "m", "time step [s]": step, "error [unit]": step}
                | {"size of the motion [unit]": 1.0, "order of the scheme [1]": 1, "about": "", "why": ""}
                for step in (1e-5, 2e-5)
            ]
            pd.DataFrame(rows).to_csv(folder / "trajectories.csv", index=False)
            (folder / "clumps.csv").write_text(CLUMPS)
            (folder / "versions.json").write_text("{}")
        return subprocess.CompletedProcess(command, self.status, None, self.stderr)


CLUMPS = """\
rows [1],pitch [1],spheres [1],contacts [1],restitution asked for [1],"restitution, n in parallel and tilt [1]",\
restitution measured [1],restitution at the scene's time step [1],"contact time, theory [s]",contact time measured [s],\
"depth at rest, theory [m]",depth at rest measured [m],time step of the scene [s]
1,1,20,20,0.7,0.4,0.4,0.4,1e-4,1e-4,1e-8,1e-8,1e-5
2,1,80,40,0.7,0.3,0.3,0.3,7e-5,7e-5,5e-9,5e-9,1e-5
"""


@pytest.fixture
def child(monkeypatch: pytest.MonkeyPatch) -> Any:
    def make(*, status: int = 0, stderr: str = "", ok: bool = True) -> Child:
        one = Child(status, stderr, ok)
        monkeypatch.setattr(commands_verify.subprocess, "run", one.run)
        return one

    return make


def test_answers_that_are_met(child: Any, smarticles: Smarticles, tmp_path: Path) -> None:
    one = child()
    said = smarticles("verify", "--out", tmp_path / "new")
    assert said.status == 0, said.err
    assert one.command[1:4] == ["-m", "smarticles.verification", "known"]
    header = said.out.strip().splitlines()[0].split()
    assert header == ["case", "quantity", "unit", "theory", "measured", "error", "tolerance", "ok"]
    assert "20 contacts" in said.out
    assert (tmp_path / "new" / "orders.csv").is_file()


def test_an_answer_that_is_not_met_is_exit_status_1(child: Any, smarticles: Smarticles, tmp_path: Path) -> None:
    child(ok=False)
    said = smarticles("verify", "--out", tmp_path)
    assert said.status == 1
    assert "1 known answer(s) not met; first: fall, way: 1 m" in said.err
    assert (tmp_path / "verification.md").is_file()


def test_without_yade_the_cause_is_told(child: Any, smarticles: Smarticles, tmp_path: Path) -> None:
    child(status=1, stderr="a warning\nYADE cannot be imported; install it\n")
    said = smarticles("verify", "--out", tmp_path)
    assert said.status == 1
    assert said.err == "smarticles: error: YADE cannot be imported; install it\n"


def test_a_file_is_no_folder(smarticles: Smarticles, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    said = smarticles("verify", "--out", tmp_path / "file")
    assert said.status == 2
    assert "choose another folder" in said.err
