"""Whatever befalls the files of a finished run, each command ends with a result or in one line.

`CORRUPTED=300 pytest tests/unit/smarticles/test_corrupted_results.py` tries so many damages of each command.
"""

import os
import random
import shutil
from collections import Counter
from pathlib import Path

import pytest
from command_cases import Smarticles
from damages import DAMAGES
from synthetic import SyntheticRun, write_run

TRIED = int(os.environ.get("CORRUPTED", "12"))
COMMANDS = {
    "measure": ["measure", "RUN"],
    "status": ["status", "RUN"],
    "export": ["export", "RUN", "--to", "vtp", "--output", "OUT"],
    "report": ["report", "RUN", "--output", "OUT.html"],
    "render": ["render", "RUN", "--output", "OUT.png", "--size", "200"],
}
LAST = ["*.json", "scene.yaml", "series.h5", "frames.pvd", "frame_000007.vtu"]
READ = {"status": ["run.json", "done.json"], "export": LAST, "render": LAST}
"""Patterns of the files that a command reads, if it does not read all."""


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_on_a_damaged_run_ends_with_a_result_or_in_one_line(
    tmp_path: Path, smarticles: Smarticles, command: str
) -> None:
    whole, out, bad = write_run(tmp_path / "whole", SyntheticRun(frames_per_phase=2)), tmp_path / "run", []
    there = [path for path in whole.rglob("*") if path.is_file() and path.stat().st_size]
    read = [path for path in there if any(path.match(pattern) for pattern in READ.get(command, ["*"]))]
    files = sorted(str(path.relative_to(whole)) for path in read)
    statuses = []
    for number in range(-1, TRIED):
        rng = random.Random(f"{command} {number}")
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(whole, out)
        file, damage = rng.choice(files), rng.choice(DAMAGES)
        if number >= 0:
            damage(out / file, rng)
        words = [
            word.replace("RUN", str(out)).replace("OUT", str(tmp_path / f"out{number}")) for word in COMMANDS[command]
        ]
        said = smarticles(*words)
        statuses.append(said.status)
        errors = [line for line in said.err.splitlines() if "warning" not in line]
        if said.status not in (0, 1, 2) or "internal error" in said.err or (said.status and len(errors) != 1):
            bad.append(f"{number}: {file} {damage.__name__}: {said.status} {said.err}")
        assert number >= 0 or said.status == 0, said.err
    print(command, Counter(statuses))
    assert not bad, "\n".join(bad)
    assert any(statuses), f"no damage meets what {command} reads"
