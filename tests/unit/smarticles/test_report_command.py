"""report: what stands on the page of a run, a sweep and a study. Its layout is tested in `test_report_browser.py`."""

import json
import math
import re
from functools import partial
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from command_cases import Smarticles, WriteRun
from scenes import small

from dem.record.document import Kind
from dem.record.run import Run
from dem.scene.reading import dump_scene
from dem.scene.scene import Scene
from postprocess.pictures import render
from postprocess.report import figures
from postprocess.report.series import thinned
from postprocess.statistics.points import means_by
from smarticles.reporting.charts import Groups, against_variable
from smarticles.reporting.run import _moment, accuracy_blocks, drawn_as, effect_blocks
from smarticles.reporting.sweep import _figures
from smarticles.sweeps import changed_sweep, folder_of, make_folder
from studies.registry import shipped
from templates.sweep.expand import expand


class Read(HTMLParser):
    """Texts, tags and tables of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.rows: list[list[str]] = []
        self._inside: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._inside.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        while self._inside and self._inside.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if "style" not in self._inside:
            self.text += data
        if self._inside and self._inside[-1] in ("td", "th"):
            self.rows[-1][-1] += data

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]

    def row(self, *first: str) -> list[str]:
        return next(row for row in self.rows if row[: len(first)] == list(first))


@pytest.fixture(autouse=True)
def _few_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Piles are drawn from two sides, all 24 in `test_report_browser.py`; figures are not written as PDF, slow here."""
    monkeypatch.setattr(render, "turntable", partial(render.turntable, views=2))
    monkeypatch.setattr(figures, "save", partial(figures.save, formats=("png", "svg")))


@pytest.fixture
def run(tmp_path: Path, write_run: WriteRun) -> Path:
    """A run of a scene that this version reads."""
    directory = write_run(tmp_path / "pile", name="my pile")
    scene = small(
        {
            "count": 12,
            "name": "my pile",
            "engine": "links",
            "fidelity": {"base": "draft", "rows": 2},
            "recording": {"frame_interval_s": 0.125, "series_interval_s": 0.005},  # frames are at multiples of it
        }
    )
    (directory / "scene.yaml").write_text(dump_scene(scene), encoding="utf-8")
    return directory


def test_the_page_of_a_run_has_everything(run: Path, smarticles: Smarticles) -> None:
    (run / "log.txt").write_text("2026-11-22 07:00:00,000 WARNING two hooks\n" * 3 + "2026-11-22 07:00:00 INFO fine\n")
    said = smarticles("report", run)
    assert said.status == 0
    assert all(line.startswith("report of ") for line in said.err.splitlines())  # progress of a slow machine alone
    page = Read(run / "report.html")
    titles = [attributes["id"] for attributes in page.of("section")]
    assert titles == [
        "result", "final-state", "against-time", "scene", "effects", "settings-and-their-accuracy", "warnings",
        "how-to-repeat-it",
    ]  # fmt: skip
    # Known: φ before shaking is 0.105, at the end of it 0.130.
    assert page.row("relax")[2].startswith("0.1050 ± 0.000")
    assert page.row("shake")[2].startswith("0.1300 ± 0.000")
    assert page.row("motors", "off")[2] == "no phase actuates"
    assert page.row("container motion", "on")[2].startswith("phase 2: Γ = 2")
    # What the effect records, not the parts of the engine that compute it.
    assert page.row("series", "on")[3].startswith("files series.h5; ")
    assert not any("push_apart" in cell for row in page.rows for cell in row)
    assert page.row("rows") == ["rows", "2", "1"]
    assert page.row("links", "draft")[-1] == "this run"
    assert "This scene changes rows, which the table does not cover." in page.text
    assert page.row("warning: two hooks") == ["warning: two hooks", "3 ×"]
    assert page.row("seed")[1] == "1"
    assert [row[0] for row in page.rows if row and "threads" in row[0]] == ["threads"]  # no version of a package
    assert "smarticles run pile/scene.yaml --out pile-again" in page.text
    assert str(run.parent) not in (run / "report.html").read_text(encoding="utf-8")
    assert len(page.of("img")) >= 3


def test_knobs_that_follow_from_the_scene_are_no_changes() -> None:
    square = {"thickness_normal_m": 5e-4, "thickness_in_plane_m": 5e-4}
    blocks = "".join(accuracy_blocks(small({"engine": "links", "fidelity": "standard", "smarticle": square}), None))
    assert "this run" in blocks
    assert "This scene changes" not in blocks


def test_pictures_name_the_phase_and_the_moment_of_their_frame(run: Path) -> None:
    assert _moment(Run(run)) == "at the end of relax"
    listed = (run / "frames.pvd").read_text(encoding="utf-8").splitlines(keepends=True)
    # As of older versions, whose last phases could end without a frame.
    kept = [line for line in listed if not re.search(r"frame_0000(1[1-9])", line)]
    (run / "frames.pvd").write_text("".join(kept), encoding="utf-8")
    assert _moment(Run(run)) == "at 16.5 s, in shake"


def test_nothing_leaves_the_page_and_nothing_runs_in_it(run: Path, smarticles: Smarticles) -> None:
    smarticles("report", run)
    page = Read(run / "report.html")
    assert not {"script", "iframe", "object", "embed", "form"} & {tag for tag, _ in page.tags}
    for _, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("src", "href", "srcset"):
            assert (attributes.get(name) or "#").startswith(("#", "data:"))
    (policy,) = [a["content"] for a in page.of("meta") if a.get("http-equiv") == "Content-Security-Policy"]
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert all(attributes.get("alt") for attributes in page.of("img"))


def test_a_name_is_no_html(run: Path, smarticles: Smarticles) -> None:
    name = '</style></title><script>alert(1)</script>"><img src=x onerror="alert(1)"> {{ 7 * 7 }} $\\frac{1}{'
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8")) | {"name": name, "command": name}
    manifest["versions"]["git"] = name
    (run / "run.json").write_text(json.dumps(manifest), encoding="utf-8")
    (run / "log.txt").write_text(f"2026-11-22 07:00:00,000 WARNING beware of {name}\n", encoding="utf-8")
    assert smarticles("report", run).status == 0
    page = Read(run / "report.html")
    assert page.row(f"warning: beware of {name}")
    assert page.row("version of git")[1] == name
    assert name in page.text
    assert not [tag for tag, _ in page.tags if tag == "script"]
    assert not [a for a in page.of("img") if not (a["src"] or "").startswith("data:")]


def test_a_scene_of_another_version_is_reported_and_no_reason_to_fail(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "old")
    assert smarticles("report", run).status == 0
    assert "This version cannot read the scene of this run" in Read(run / "report.html").text


def test_a_scene_that_is_refused_today_is_reported(run: Path, smarticles: Smarticles) -> None:
    wide = {"count": 12, "engine": "links", "smarticle": {"thickness_normal_m": 3e-3}}
    scene = small(wide | {"fidelity": {"base": "standard", "rows": 2}})
    (run / "scene.yaml").write_text(dump_scene(scene), encoding="utf-8")
    assert smarticles("report", run).status == 0
    assert "2 rows side by side leave holes" in (run / "report.html").read_text()


def test_what_exists_is_kept_and_what_is_no_run_rejected(run: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    (run / "report.html").write_text("mine")
    said = smarticles("report", run)
    assert (said.status, "exists; choose another name" in said.err) == (2, True)
    assert (run / "report.html").read_text() == "mine"
    assert smarticles("report", run, "--overwrite").status == 0
    assert "use a name that ends in .html" in smarticles("report", run, "--output", tmp_path / "a.pdf").err
    assert "does not exist; make it" in smarticles("report", run, "--output", tmp_path / "no" / "a.html").err
    assert "is no run, sweep or study" in smarticles("report", tmp_path, "--output", tmp_path / "a.html").err
    none = smarticles("report", run, "--output", tmp_path / "b.html", "--accuracy", tmp_path / "none.csv")
    assert (none.status, f"--accuracy {tmp_path / 'none.csv'}: cannot be read" in none.err) == (2, True)
    assert not (tmp_path / "b.html").exists()


# -- sweeps and studies ------------------------------------------------------------------------------------------------


def test_the_page_of_a_sweep_has_means_and_figures(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    content = yaml.safe_load(sweep_file.read_text())
    content |= {"repeats": {"seeds": [1, 2]}, "run_name": "n{{ count }}_{{ seed }}"}
    sweep_file.write_text(yaml.safe_dump(content))
    (tmp_path / "scene.yaml.j2").write_text(
        (tmp_path / "scene.yaml.j2").read_text().replace("seed: 1", "seed: {{ seed }}")
    )
    folder = make_folder(sweep_file, tmp_path / "out", "smarticles sweep <hostile>")
    packing = dict(zip((entry.name for entry in folder.entries), (0.12, 0.14, 0.2, 0.3), strict=True))
    for entry in folder.entries[:3]:
        phi = packing[entry.name]
        write_run(folder.run(entry), packing=(0.1, 0.1, phi, phi), **{k: entry.values[k] for k in ("count", "seed")})
    assert smarticles("report", folder.path).status == 0
    page = Read(folder.path / "report.html")
    assert page.row("5", "2", "2 of 2 finished")[4].startswith("0.1300 ± 0.0100")
    assert page.row("6", "1", "1 of 2 finished")[4] == "0.2000"
    assert page.row("n6_2")[:2] == ["n6_2", "missing"]
    assert page.row("contact")[1] == "4 of 4"
    assert page.row("count", "5, 6")[2] == "2"
    assert "smarticles sweep <hostile>" in page.text
    alts = [attributes["alt"] for attributes in page.of("img")]
    assert "phi second-highest-com against count, from 0.13 to 0.2" in alts
    assert "Means over finished runs ± standard error, phase 3 (relax)." in page.text
    # The phase that is asked for comes first; the others are folded.
    assert smarticles("report", folder.path, "--phase", "deposit", "--overwrite").status == 0
    page = Read(folder.path / "report.html")
    assert page.row("5", "2", "2 of 2 finished")[4].startswith("0.1000 ± 0.000")
    folded = page.text.count("Means over finished runs ± standard error, phase ")
    assert folded == 1 + 2 * 3  # caption of the table, and of a folded one its summary, too
    unknown = smarticles("report", folder.path, "--phase", "shakes", "--overwrite")
    assert unknown.status == 2
    assert "--phase shakes: no run has a phase 'shakes'; did you mean 'shake'?" in unknown.err


def test_a_study_is_analysed_drawn_and_reported(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    folder = make_folder(
        shipped("gravish").sweep_file(quick=True), tmp_path / "study", "smarticles study gravish --quick"
    )
    *finished, last = folder.entries
    for entry in finished:
        known = {"aspect_ratio": entry.values["l_over_w"], "seed": entry.values["seed"]}
        known["friction"] = 0.4 if entry.values["contact"] == "paper" else 0.8
        made = write_run(folder.run(entry), count=6, frames_per_phase=1, **known) / "run.json"
        facts = {"scene_sha256": entry.scene_sha256, "engine": entry.values["engine"]}
        made.write_text(json.dumps(json.loads(made.read_text(encoding="utf-8")) | facts), encoding="utf-8")
    # What remains fails before an engine is needed.
    folder.scene(last).write_text("count: []")
    smarticles("report", folder.path)
    before = Read(folder.path / "report.html").text
    assert "smarticles study gravish --quick --out study --analyse" in before

    said = smarticles("study", "gravish", "--quick", "--out", folder.path)
    assert said.status == 1
    lines, results = said.out.splitlines(), folder.path / "results"
    assert lines[0].startswith("not the full study: 33 runs instead of 137; ")
    assert "; shake_s: 1.5 instead of 20.0 in 3 of 33 runs; " in lines[0]
    assert lines[1] == f"the full study found: {shipped('gravish').found}"
    assert "(results/gravish)" in lines[1]
    assert re.split(r"  +", lines[3])[:5] == ["links", "friction 0.4 as in the paper", "0.4", "20", "3"]
    for table in ("points.csv", "deviations.csv", "findings.md"):
        assert f"The full study found: {shipped('gravish').found}" in (results / table).read_text(encoding="utf-8")
    assert "FOUND: φ_f is above φ_0 at every l/w" in lines
    drawn = [line.removeprefix("figure: ") for line in lines if line.startswith("figure: ")]
    assert drawn
    assert all(Path(figure).is_file() for figure in drawn)
    assert lines[-1] == f"picture of lw0.70_links_seed1: {results / 'run.png'}"
    assert f"1 of 33 runs are missing: {last.name}: " in said.err.splitlines()[-1]
    assert last.name in (results / "missing.csv").read_text(encoding="utf-8")

    assert smarticles("report", folder.path, "--overwrite").status == 0
    page = Read(folder.path / "report.html")
    assert page.row("φ_f is above φ_0 at every l/w")[2] == "found"
    assert any(
        row[:2] == ["links", "phi_f"] and "0.7" in row and "0.13" in row for row in page.rows
    )  # Gravish's, at 0.7
    assert any("Gravish et al., PRL 108, 208001" in line for line in page.text.splitlines())
    assert [alt for a in page.of("img") if (alt := a["alt"] or "").startswith("Figure “phi” of the study gravish")]
    # The results alone make a page as well.
    assert smarticles("report", results, "--output", tmp_path / "results.html").status == 0
    assert Read(tmp_path / "results.html").row("φ_f is above φ_0 at every l/w")


def test_a_sweep_with_the_name_of_a_study_is_a_sweep(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    sweep_file.write_text(sweep_file.read_text().replace("name: counts", "name: friction"))
    folder = make_folder(sweep_file, tmp_path / "friction", "test")
    write_run(folder.run(folder.entries[0]), phases=("deposit", "relax", "shake"), frames_per_phase=1)
    smarticles("report", folder.path)
    page = Read(folder.path / "report.html")
    assert "smarticles study" not in page.text
    assert "friction – sweep" in page.text
    # A drive is last, but the last rest comes first.
    assert page.text.index("phase 1 (relax)") < page.text.index("phase 2 (shake)")


@pytest.mark.parametrize(
    ("name", "engine", "words"),
    [
        ("strength-code", None, "strength-code --quick"),
        ("compaction", None, "compaction"),
        ("compaction", "yade", "compaction --engine yade"),
    ],
)
def test_a_study_is_known_by_its_files(
    name: str, engine: str | None, words: str, tmp_path: Path, smarticles: Smarticles
) -> None:
    sweep = changed_sweep(shipped(name).sweep_file(quick="--quick" in words), engine=engine)
    points = expand(sweep)[:2]
    folder = folder_of(sweep, points, tmp_path / "mine", "test", expected_s=[1.0] * 2)
    smarticles("report", folder.path)
    page = Read(folder.path / "report.html")
    assert f"smarticles study {words} --out mine --analyse" in page.text
    manifest = folder.path / "sweep.json"
    content = json.loads(manifest.read_text(encoding="utf-8"))
    content["files"] = {file: f"{text}# changed" for file, text in content["files"].items()}
    manifest.write_text(json.dumps(content), encoding="utf-8")
    smarticles("report", folder.path, "--overwrite")
    assert "smarticles study" not in Read(folder.path / "report.html").text


# -- parts -------------------------------------------------------------------------------------------------------------


def test_charts_of_several_variables_have_intervals_and_a_part_for_each_combination() -> None:
    # Two and three values with a standard error of 0.1; a run without a value does not count for the interval.
    scatters = {0: (-0.1, 0.1), 6: (-math.sqrt(0.03), 0.0, math.sqrt(0.03), math.nan)}
    rows = [
        {"theta": theta, "omega": omega, "l_over_w": aspect, "crossings mean [-]": theta + omega + aspect + scatter}
        for theta in (5, 10, 15)
        for omega in (0, 6)
        for aspect in (0.4, 0.7)
        for scatter in scatters[omega]
    ]
    varied = {"theta": [5, 10, 15], "omega": [0, 6], "l_over_w": [0.4, 0.7]}
    drawn = {}

    def noted(variable: str, label: str, groups: Groups) -> str:
        drawn[len(drawn)] = groups
        return against_variable(variable, label, groups)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("smarticles.reporting.sweep.against_variable", noted)
        blocks = _figures(means_by(pd.DataFrame(rows), list(varied), intervals=True), list(varied), varied, "relax")
    assert len(blocks) == 2  # a chart for each l/w
    assert "against theta, l_over_w = 0.4" in blocks[0]
    assert "95 % intervals" in blocks[0]
    assert "3 of 6 points have fewer than 3 runs" in blocks[0]
    assert list(drawn[1]) == ["omega = 0", "omega = 6"]
    xs, means, half_widths = drawn[1]["omega = 6"]
    assert (list(xs), means) == ([5, 10, 15], pytest.approx([11.7, 16.7, 21.7]))
    assert half_widths == pytest.approx([4.303 * 0.1] * 3, rel=1e-3)  # Student's t, three values
    assert drawn[1]["omega = 0"][2] == pytest.approx([12.706 * 0.1] * 3, rel=1e-3)  # two runs


def test_the_chart_of_a_packing_fraction_leaves_out_a_lifted_pile(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "a", phases=("deposit", "relax", "pull-hook"), frames_per_phase=1)
    smarticles("report", run)
    page = Read(run / "report.html")
    # φ is 0.105 at the end of the rest, and 0.130 of the made-up pull.
    (alt,) = [alt for a in page.of("img") if (alt := a["alt"] or "").startswith("packing fraction against time")]
    assert alt.endswith("to 0.105")
    assert "It is left out where grips or a raised hook hold bodies" in page.text


@pytest.mark.parametrize(
    ("rounds", "drawn"),
    [((), "boxes"), ((False,), "boxes"), ((True, True), "cylinders"), ((True, False), "boxes and cylinders")],
)
def test_captions_name_the_sections_of_bodies(rounds: tuple[bool, ...], drawn: str) -> None:
    kinds = [
        Kind(
            shape="rod", bodies=1, bars=1, mass_kg=1.0, volume_m3=1.0, length_m=1.0, thickness_normal_m=1.0,
            thickness_in_plane_m=1.0, round=one, sphere_diameter_m=1.0,
        )
        for one in rounds
    ]  # fmt: skip
    assert drawn_as(kinds or None) == drawn


def test_reasons_of_effects_are_those_of_all_scenes() -> None:
    def scene(speed: float) -> Scene:
        gait = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1}
        motor = {"speed_limit_rad_per_s": speed}
        return Scene(seed=1, count=5, engine="links", phases=[{"type": "deposit"}, gait], motor=motor)

    (page,) = effect_blocks([scene(3.0), scene(6.0), scene(12.0)])
    assert all(f"{speed:g} rad/s" in page for speed in (3, 6, 12))


def test_a_thinned_curve_keeps_its_extremes() -> None:
    times = np.linspace(0, 1, 10_001)
    values = np.sin(50 * times)
    values[777], values[5000] = 9.0, math.nan
    few_times, few = thinned(times, values)
    assert len(few) <= 400
    assert (few.max(), few.min()) == (9.0, np.nanmin(values))
    assert times[777] in few_times
    assert (np.diff(few_times) > 0).all()
