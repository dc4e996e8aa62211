"""One run of a study on links, from the command to its table: no YADE in it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd
import yaml

from dem.record.run import open_run
from studies.engines import STUDY
from studies.registry import shipped
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep


def test_a_scene_for_yade_is_run_on_links_and_measured(tmp_path: Path) -> None:
    point = next(
        p for p in expand(load_sweep(shipped("engines").sweep_file(quick=True))) if p.name == "external_yade_seed1"
    )
    data = point.scene.model_dump(mode="json") | {"count": 6, "name": "external/links"}
    data["phases"][2]["duration_s"] = 0.1
    data["phases"][1]["duration_s"] = data["phases"][3]["duration_s"] = 0.05
    data["recording"] |= {"frame_interval_s": 0.02}
    scene, run = tmp_path / "scene.yaml", tmp_path / "external_links_seed1"
    scene.write_text(yaml.safe_dump(data), encoding="utf-8")
    command = [sys.executable, "-m", "smarticles", "run", str(scene), "--out", str(run), "--engine", "links"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    manifest = open_run(run).manifest
    assert (manifest.engine, "links" in manifest.versions, "yade" in manifest.versions) == (
        "links",
        True,
        False,
    )
    report = STUDY.analyse([run], tmp_path / "out", note="a test", command="test")
    runs = pd.read_csv(report.files["runs.csv"], comment="#")
    assert runs["engine"].tolist() == ["links"]
    assert 0.0 < runs["static phi second-highest-com [-]"].iloc[0] < 0.5
    assert runs["energy per smarticle [J]"].iloc[0] > 0
    assert {one.verdict for one in report.judged} == {"no data"}
