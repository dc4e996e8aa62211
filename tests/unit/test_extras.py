"""With the project's dependencies alone a scene is run, swept and measured; other commands name what they need."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from smarticles.commands.doctor import EXTRAS

REPOSITORY = Path(__file__).resolve().parents[2]
BLOCKED = sorted({*EXTRAS, "sphinx", "myst_parser", "pytest", "hypothesis", "yade"})
# Loaded by every interpreter that finds it, also those of a sweep's runs.
BLOCKER = f"""
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {BLOCKED!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Blocker())
"""
SCENE = """\
schema_version: 1
seed: {{ seed }}
count: 4
engine: links
fidelity: draft
phases:
  - {type: deposit}
"""
SWEEP = """\
schema_version: 1
name: small
template: scene.yaml.j2
run_name: "seed{{ seed }}"
points: {list: [{}]}
repeats: {seeds: [1, 2]}
"""
CALIBRATION = """\
schema_version: 1
name: small
template: contact.yaml.j2
free: {friction: {low: 0.2, high: 1.0}}
data: data.csv
budget: 10
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene, a sweep, and an interpreter's start-up file that blocks all that extras bring."""
    folder = tmp_path_factory.mktemp("core")
    (folder / "sitecustomize.py").write_text(BLOCKER)
    (folder / "scene.yaml.j2").write_text(SCENE)
    (folder / "contact.yaml.j2").write_text(SCENE + "contact: {friction_smarticle: {{ friction }}}\n")
    (folder / "sweep.yaml").write_text(SWEEP)
    (folder / "calibration.yaml").write_text(CALIBRATION)
    (folder / "data.csv").write_text("measure,value,error\nphi second-highest-com [-],0.1,0.01\n")
    return folder


def call(place: Path, *words: str) -> subprocess.CompletedProcess[str]:
    variables = {**os.environ, "PYTHONPATH": f"{place}{os.pathsep}{REPOSITORY}", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "smarticles", *words]
    return subprocess.run(command, cwd=place, env=variables, capture_output=True, text=True, check=False)


def test_run_sweep_and_measure_need_no_extra(place: Path) -> None:
    # A sweep starts `smarticles run` in interpreters that block the extras as well.
    for words in (
        ["sweep", "sweep.yaml", "--out", "many", "--submit", "local"],
        ["compare", "many/runs/seed1", "many/runs/seed2"],
        ["status", "many"],
        ["measure", "many/runs/seed1", "--profile", "rings.csv"],
        ["--completion", "bash"],
    ):
        done = call(place, *words)
        assert (done.returncode, done.stderr if words[0] != "sweep" else "") == (0, ""), (words, done.stderr)
    rows = json.loads(call(place, "measure", "many", "--by", "seed", "--json").stdout)
    assert [(row["seed"], row["phase type"]) for row in rows] == [(1, "deposit"), (2, "deposit")]


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (["render", "a"], "viz"),
        (["report", "a"], "viz"),
        (["export", "a", "--to", "glb"], "viz"),
        (["view", "a", "--no-browser"], "view"),
        (["calibrate", "calibration.yaml", "--out", "c"], "calibrate"),
        (["study", "gravish", "--quick", "--out", "g", "--analyse"], "viz"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else value,
)
def test_what_an_extra_is_needed_for_names_it(place: Path, words: list[str], extra: str) -> None:
    done = call(place, *words)
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("smarticles: error: the Python package '")
    assert line.endswith(
        f"is missing; install it: pip install 'smarticles[{extra}]', or `make setup` in the repository"
    )
