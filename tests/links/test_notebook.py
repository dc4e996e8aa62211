"""The notebook and README's Python run from top to bottom in a fresh process; numbers are those of their runs.

The notebook's cells are plain Python and are run as such: a Jupyter kernel would bring another IPython than the one
that YADE imports.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import smarticles

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "examples" / "gait.ipynb"


@pytest.fixture(scope="module")
def worked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that it was run in."""
    folder = tmp_path_factory.mktemp("notebook")
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    assert "20 smarticles at " in done(code, folder)
    return folder


def done(code: str, folder: Path) -> str:
    """What some code says, run in a folder by a fresh process to which warnings are errors."""
    (folder / "cells.py").write_text(code, encoding="utf-8")
    known = {**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    said = subprocess.run(
        [sys.executable, "-W", "error", "cells.py"], cwd=folder, env=known, capture_output=True, text=True, check=False
    )
    assert said.returncode == 0, said.stderr
    return said.stdout


def test_it_draws_what_it_says(worked: Path) -> None:
    for name, size in (("height.png", (690, 1380)), ("amplitude.png", (390, 750))):
        with Image.open(worked / name) as image:
            pixels = np.asarray(image.convert("L"))
        assert pixels.shape == size
        # Neither blank nor black: lines on white.
        assert 0.005 < (pixels < 128).mean() < 0.2


def test_its_means_are_those_of_its_runs(worked: Path) -> None:
    many = smarticles.read_sweep(worked / "runs" / "amplitudes")
    means = many.table(by="amplitude_deg")
    active = means[means["phase type"] == "actuate"]
    assert active["amplitude_deg"].tolist() == [2.0, 8.0, 14.0]
    heights = [smarticles.measure(run).set_index("phase type").loc["actuate", "com height [m]"] for run in many[2:4]]
    assert active["com height [m]"].iloc[1] == pytest.approx(np.mean(heights), rel=1e-12)
    assert active["com height SE [m]"].iloc[1] == pytest.approx(abs(heights[0] - heights[1]) / 2, rel=1e-9)


def test_python_of_readme(tmp_path: Path) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert done(f"{code}\nprint(len(many), *smarticles.measure(done)['phase type'])", tmp_path) == "4 deposit shake\n"
