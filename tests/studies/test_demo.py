"""The demo: its runs are published ones and fit into its time, its numbers stand beside the table's."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from synthetic import SyntheticRun, write_run

from postprocess.statistics.points import SEED
from smarticles.sweeps import expected_wall_s, make_folder
from studies.demo.__main__ import RESULTS, TABLE, Compared, main
from studies.framework.runs import read_runs
from studies.registry import FOLDER
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

SWEEP = FOLDER / "demo" / "sweep.yaml"
SECONDS = 60  # of simulation: with 15 s for compiling and 15 s for setup and drawing, a minute and a half

PHASES = {"shape-change": "shape-change", "internal": "internal-oscillation", "external": "shake"}


def test_the_runs_are_of_one_seed_of_the_published_table_at_standard() -> None:
    points = expand(load_sweep(SWEEP))
    rows = read_runs(RESULTS / TABLE).set_index("scene_sha256").loc[[point.scene_sha256 for point in points]]
    assert sorted(rows["procedure"]) == ["external", "internal", "shape-change"]
    assert rows["aspect ratio [-]"].eq(1.0).all()
    assert rows[SEED].nunique() == 1
    assert rows["fidelity"].eq("standard").all()


def test_two_cores_compute_them_within_a_minute() -> None:
    free = [0.0, 0.0]
    for run_s in sorted((expected_wall_s(point.scene) for point in expand(load_sweep(SWEEP))), reverse=True):
        free[free.index(min(free))] += run_s
    assert 5 < max(free) < SECONDS


def test_sentences_have_the_numbers_of_the_runs_beside_those_of_the_readme_of_the_table() -> None:
    published = read_runs(RESULTS / TABLE)
    demo = published[(published[SEED] == 1) & (published["aspect ratio [-]"] == 1.0)]
    poured, reshaped, others = Compared(demo, published).sentences()
    assert "6.35 (6.35 ± 0.16" in poured
    assert "l/w = 1.0" in poured
    assert "8 published seeds" in poured
    assert "11.13 (10.98 ± 0.24" in reshaped
    assert "1.37 (1.33 ± 0.03" in reshaped
    assert re.search(r"shaking.*10\.13 \(10\.06 ± 0\.12.* 8\.24 \(8\.43 ± 0\.13", others, re.IGNORECASE)
    ranges = [[float(end) for end in pair] for pair in re.findall(r"([\d.]+) to ([\d.]+)\)", reshaped)]
    assert ranges[0] == [9.98, 12.39]


def test_a_run_of_other_numbers_is_seen_beside_the_published_ones() -> None:
    published = read_runs(RESULTS / TABLE)
    demo = published[(published[SEED] == 1) & (published["aspect ratio [-]"] == 1.0)].copy()
    demo["crossings [-]"] = 5.0
    assert "5.00 (10.98 ± 0.24" in Compared(demo, published).sentences()[1]


def _write(folder: Path, *, left_out: str = "") -> None:
    made = make_folder(SWEEP, folder, "test")
    for entry in made.entries:
        if entry.name == left_out:
            continue
        run = SyntheticRun(
            aspect_ratio=1.0, count=8, work=1e-3, phases=("deposit", "relax", PHASES[entry.name], "relax")
        )
        manifest = write_run(made.run(entry), run) / "run.json"
        content = json.loads(manifest.read_text()) | {"scene_sha256": entry.scene_sha256, "engine": "links"}
        manifest.write_text(json.dumps(content))


def test_picture_figure_and_three_sentences_are_all_that_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(tmp_path / "demo")
    main([str(tmp_path / "demo")])
    picture, figure, *sentences = capsys.readouterr().out.splitlines()
    assert len(sentences) == 3
    for line in (picture, figure):
        with Image.open(line.partition(": ")[2]) as image:
            assert np.asarray(image.convert("L")).std() > 5  # not blank
    with Image.open(tmp_path / "demo" / "picture.png") as image:
        assert image.width == 4 * image.height  # as poured, and after each of three procedures


@pytest.mark.parametrize(
    ("left_out", "said"), [("internal", r"internal is not done; go on with: smarticles resume"), (None, "no scene of")]
)
def test_another_sweep_or_an_unfinished_one_is_rejected(
    left_out: str | None, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if left_out:
        _write(tmp_path / "demo", left_out=left_out)
    else:
        make_folder(FOLDER / "procedures.yaml@quick", tmp_path / "demo", "test")
    with pytest.raises(SystemExit) as stopped:
        main([str(tmp_path / "demo")])
    assert stopped.value.code == 2
    assert re.search(said, capsys.readouterr().err)
    assert not list((tmp_path / "demo").glob("*.png"))
