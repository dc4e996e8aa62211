"""measure and render: run directories in, tables and pictures out."""

import csv
import json
from pathlib import Path

import pandas as pd
import pytest
from command_cases import Smarticles, WriteRun
from PIL import Image

from dem.record.run import Run
from postprocess.measures.table import summarise_run


def test_measure_writes_a_profile_of_each_run_beside_the_table(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    runs = [write_run(tmp_path / "a"), write_run(tmp_path / "b", seed=2)]
    profile = tmp_path / "profile.csv"
    said = smarticles("measure", *runs, "--profile", profile)
    assert said.status == 0
    with profile.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert said.out.splitlines()[-1] == f"{profile}: φ(r, z), {len(rows)} rows"
    assert {row["run"] for row in rows} == {str(run) for run in runs}
    assert {row["phase type"] for row in rows} == {"deposit", "relax", "shake"}
    assert len({row["inner radius [m]"] for row in rows}) == 6
    assert max(float(row["phi voxel [-]"]) for row in rows) > 0.01
    again = smarticles("measure", runs[0], "--profile", profile)
    assert (again.status, "exists" in again.err) == (2, True)
    both = smarticles("measure", runs[0], "--profile", tmp_path / "x.csv", "--table", tmp_path / "x.csv")
    assert (both.status, "is the file of --table too" in both.err) == (2, True)


def test_a_profile_of_other_bodies_is_rejected_before_anything_is_measured(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "a")
    file = run / "run.json"
    section = {"thickness_normal_m": 1e-3, "thickness_in_plane_m": 1e-3, "round": True, "sphere_diameter_m": 1e-3}
    rod = {"shape": "rod", "bodies": 12, "bars": 1, "mass_kg": 1e-4, "volume_m3": 1e-8, "length_m": 0.015, **section}
    file.write_text(json.dumps({**json.loads(file.read_text()), "kinds": [rod]}))
    said = smarticles("measure", run, "--profile", tmp_path / "p.csv", "--table", tmp_path / "t.csv")
    assert (said.status, said.out) == (2, "")
    assert "needs smarticles: the bodies of this run are of the shape rod; leave out the profile" in said.err
    assert not (tmp_path / "t.csv").exists()


def test_measure_gives_json_without_nan(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    run = write_run(tmp_path / "a")
    said = smarticles("measure", run, "--frames", "--json")
    assert said.status == 0

    def reject(word: str) -> None:
        raise AssertionError(word)

    rows = json.loads(said.out, parse_constant=reject)
    assert [row["frame"] for row in rows] == list(range(16))
    assert rows[0]["phi voxel [-]"] is None
    assert 0.05 < rows[0]["phi second-highest-com [-]"] < 0.2


def test_measure_adds_measures_on_request_alone(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    run = write_run(tmp_path / "a")
    plain = json.loads(smarticles("measure", run, "--json").out)[-1]
    more = json.loads(smarticles("measure", run, "--json", "--also", "crossing-number,closed-linking,orientation").out)[
        -1
    ]
    assert {name: more[name] for name in plain} == plain
    added = {name for name in set(more) - set(plain) if " SE " not in name}
    assert added == {
        "average crossing number mean [-]",
        "nematic order of all links [-]",
        "polar order of mouths [-]",
        "mouths upwards [-]",
        "closed linking number mean [-]",
        "linked graph largest share [-]",
    }
    assert more["average crossing number mean [-]"] > 0.1
    said = smarticles("measure", run, "--also", "crossing-number,orientation")
    assert "⟨ACN⟩: average crossing number" in said.out
    # What was asked for is printed too.
    (row,) = (line for line in said.out.splitlines() if line.startswith("shake"))
    assert said.out.split("\n")[0].split("  ")[-1] == "mouths upwards"
    assert float(row.split()[-1]) == pytest.approx(more["mouths upwards [-]"], abs=0.1)
    caged = smarticles("measure", run, "--also", "caging").out  # not on the engine of this run
    assert "note: --also caging: this measure does not apply to these runs" in caged
    assert "does not apply" not in said.out
    unknown = smarticles("measure", run, "--also", "caging,crossing")
    assert unknown.status == 2
    assert "also: there is no measure 'crossing' to add; did you mean 'crossing-number'?" in unknown.err


def test_measure_takes_a_sweep_whose_fidelity_is_a_mapping(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    out = tmp_path / "out"
    mapping = "constants: {fidelity: {base: draft, rows: 1}}\npoints:"
    sweep_file.write_text(sweep_file.read_text().replace("points:", mapping))
    smarticles("sweep", sweep_file, "--out", out)
    for name in ("n5", "n6"):
        write_run(out / "runs" / name)
    said = smarticles("measure", out, "--table", tmp_path / "table.csv")
    assert said.status == 0, said.err
    swept = pd.read_csv(tmp_path / "table.csv", comment="#")["fidelity (swept)"]
    assert set(swept) == {'{"base": "draft", "rows": 1}'}


def test_measure_has_the_variables_of_a_sweep_and_means_by_them(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    out, table = tmp_path / "out", tmp_path / "table.csv"
    sweep_file.write_text(sweep_file.read_text().replace("grid: {count: [5, 6]}", "grid: {count: [5, 6], kind: [a]}"))
    smarticles("sweep", sweep_file, "--out", out)
    for name, count, last in (("n5", 5, 0.12), ("n6", 6, 0.14)):
        write_run(out / "runs" / name, count=count, packing=(0.1, 0.1, last, last))
    smarticles("measure", out, "--table", table)
    with table.open(encoding="utf-8") as file:
        assert [(row["kind"], row["count"]) for row in csv.DictReader(file)] == [("a", "5")] * 4 + [("a", "6")] * 4
    said = smarticles("measure", out, "--by", "kind")
    lines = said.out.splitlines()
    assert lines[0].split()[:3] == ["kind", "runs", "phase"]
    assert [line.split()[:3] for line in lines[1:5]] == [
        ["a", "2", kind] for kind in ("deposit", "relax", "shake", "relax")
    ]
    # Of 0.12 and 0.14: their mean, and half their difference.
    assert lines[3].split()[4:8] == ["5.5", "0.5", "0.1300", "0.0100"]
    assert lines[0].count("± SE") > 4
    assert "standard error over runs" in said.out
    rest = smarticles("measure", out, "--by", "kind", "--by", "count", "--phase", "last").out.splitlines()
    assert [line.split()[:4] for line in rest[1:3]] == [["a", "5", "1", "relax"], ["a", "6", "1", "relax"]]
    unknown = smarticles("measure", out, "--phase", "shakes")
    assert unknown.status == 2
    assert "--phase shakes: no run has a phase 'shakes'; did you mean 'shake'?" in unknown.err


def test_means_are_those_of_finished_runs_unless_asked(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    out, table = tmp_path / "out", tmp_path / "means.csv"
    text = sweep_file.read_text().replace("[5, 6]", "[5, 6, 7]").replace("n{{ count }}", "n{{ count }}_{{ seed }}")
    sweep_file.write_text(text + "repeats: {seeds: [1, 2]}\n")
    template = tmp_path / "scene.yaml.j2"
    template.write_text(template.read_text().replace("seed: 1", "seed: {{ seed }}"))
    smarticles("sweep", sweep_file, "--out", out)
    runs = {"n5_1": ("done", 0.12), "n5_2": ("failed", 0.14), "n6_1": ("unfinished", 0.16)}
    for name, (status, last) in runs.items():
        count, seed = (int(number) for number in name[1:].split("_"))
        write_run(out / "runs" / name, packing=(0.1, 0.1, last, last), status=status, count=count, seed=seed)
    rows = json.loads(smarticles("measure", out, "--json").out)
    assert [row["state"] for row in rows[::4]] == ["done", "failed", "stopped"]
    lines = smarticles("measure", out).out.splitlines()
    assert [line for line in lines if line.endswith(":")] == [
        f"{out}/runs/n5_1:", f"{out}/runs/n5_2 (failed):", f"{out}/runs/n6_1 (stopped):"
    ]  # fmt: skip
    said = smarticles("measure", out, "--by", "count", "--phase", "last", "--table", table)
    assert said.out.splitlines()[1].split()[:6] == ["5", "1", "1", "of", "2", "finished"]
    assert said.out.splitlines()[2].split()[:6] == ["6", "0", "0", "of", "2", "finished"]
    assert "note: 1 of 6 runs are finished, 3 missing, 1 failed, 1 stopped; means leave them out" in said.out
    means = pd.read_csv(table, comment="#")
    assert means["state"].tolist() == ["1 of 2 finished", "0 of 2 finished"]
    assert means["phi second-highest-com [-]"].iloc[0] == pytest.approx(0.12)
    assert pd.isna(means["phi second-highest-com [-]"].iloc[1])
    everything = json.loads(
        smarticles("measure", out, "--by", "count", "--phase", "last", "--unfinished", "--json").out
    )
    assert [row["phi second-highest-com [-]"] for row in everything] == pytest.approx([0.13, 0.16])
    assert [row["runs [-]"] for row in everything] == [2, 1]
    alone = smarticles("measure", out, "--unfinished")
    assert (alone.status, "--unfinished: is for means over runs, which --by makes" in alone.err) == (2, True)


def test_the_legend_is_about_columns_that_are_printed(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "a", count=1)
    out = smarticles("measure", run).out
    assert "z: height" in out
    assert not any(word in out for word in ("φ", "voxel", "voronoi", "peak F/nW"))
    assert "of a pour" in out
    assert "of a pour" not in smarticles("measure", run, "--phase", "shake").out
    assert "SE:" not in out
    assert "SE:" in smarticles("measure", write_run(tmp_path / "b")).out


def test_a_phase_that_takes_no_time_has_a_row_without_means(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "a")
    for name in ("run.json", "done.json"):
        manifest = json.loads((run / name).read_text())
        last = manifest["phases"][-1]
        end = {"start_s": last["end_s"], "end_s": last["end_s"]} if "end_s" in last else {}
        manifest["phases"].append({**last, **end, "index": last["index"] + 1, "type": "release"})
        (run / name).write_text(json.dumps(manifest))
    for phase in ("release", "last"):
        (row,) = json.loads(smarticles("measure", run, "--phase", phase, "--json").out)
        assert (row["phase"], row["phase type"], row["time [s]"]) == (4, "release", 22.0)
        assert (row["frames averaged"], row["phi second-highest-com [-]"]) == (0, None)
    assert "note:" not in smarticles("measure", run).out
    said = smarticles("measure", run, "--phase", "lift")
    assert (said.status, "no run has a phase 'lift'" in said.err) == (2, True)


def test_phases_of_older_runs_without_frames_keep_their_rows_and_are_named(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    runs = [write_run(tmp_path / name, frames_per_phase=1) for name in ("a", "b", "whole")]
    for run in runs[:2]:
        listed = (run / "frames.pvd").read_text(encoding="utf-8").splitlines(keepends=True)
        kept = [line for line in listed if "frame_000001" not in line]
        (run / "frames.pvd").write_text("".join(kept), encoding="utf-8")
    said = smarticles("measure", *runs)
    note = f"note: {runs[0]} and 1 more: phase 1 (relax) has no frame, and so no means; run it anew"
    assert [line for line in said.out.splitlines() if line.startswith("note:")] == [
        f"{note}, since each phase ends with a frame"
    ]
    assert note in smarticles("measure", *runs, "--by", "seed").out
    assert "note:" not in smarticles("measure", runs[2]).out
    rows = json.loads(smarticles("measure", runs[0], "--json").out)
    assert [(row["phase"], row["frames averaged"]) for row in rows] == [(0, 1), (1, 0), (2, 1), (3, 1)]


def test_measure_keeps_the_tables_of_runs_that_have_not_changed(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    measured = []
    measure = summarise_run

    def noted(run: Run, **keywords: object) -> pd.DataFrame:
        measured.append(run.path.name)
        return measure(run, **keywords)  # type: ignore[arg-type]

    monkeypatch.setattr("postprocess.measures.table.summarise_run", noted)
    runs = [write_run(tmp_path / name, seed=seed) for seed, name in enumerate("ab")]
    first = smarticles("measure", *runs, "--json").out
    assert smarticles("measure", *runs, "--json").out == first
    assert measured == ["a", "b"]
    # Other frames, a damaged table, and a directory with another name.
    frame = runs[0] / "frames" / "frame_000009.vtu"
    frame.write_bytes((runs[1] / "frames" / "frame_000009.vtu").read_bytes())
    kept = runs[1] / ".measures-phases-phase-end.txt"
    kept.write_text(kept.read_text().replace("0.1", "0.2"))
    again = smarticles("measure", *runs, "--json").out
    assert measured == ["a", "b", "a", "b"]
    rows, before = json.loads(again), json.loads(first)
    assert rows[4:] == before[4:]
    assert rows[:4] != before[:4]
    moved = runs[1].rename(tmp_path / "moved")
    assert {row["run"] for row in json.loads(smarticles("measure", moved, "--json").out)} == {str(moved)}
    assert measured == ["a", "b", "a", "b"]


def test_a_frame_that_is_cut_off_has_a_way_out_that_works(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "a")
    frame, listed = run / "frames" / "frame_000003.vtu", run / "frames.pvd"
    frame.write_bytes(frame.read_bytes()[:500])
    said = smarticles("measure", run)
    assert (said.status, said.out) == (2, "")
    assert f"cannot read frame {frame}: truncated" in said.err
    assert f"remove its line from {listed} to do without it, or run {run / 'scene.yaml'} anew elsewhere" in said.err
    listed.write_text("\n".join(line for line in listed.read_text().splitlines() if frame.name not in line))
    rows = json.loads(smarticles("measure", run, "--frames", "--json").out)
    assert len(rows) == 15


def test_measure_warns_that_a_series_is_gone(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    run = write_run(tmp_path / "a")
    assert smarticles("measure", run).err == ""
    (run / "series.h5").unlink()
    said = smarticles("measure", run, "--json")
    assert said.status == 0
    assert len(json.loads(said.out)) == 4
    (line,) = said.err.splitlines()
    assert line.startswith(f"smarticles: warning: {run / 'series.h5'}: is gone, although the run is done, ")
    assert "put it back, or run" in line


@pytest.mark.parametrize("command", ["render", "measure", "status", "resume"])
def test_places_that_are_neither_run_nor_sweep(command: str, tmp_path: Path, smarticles: Smarticles) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "note.txt").write_text("x")
    both = command in ("status", "resume")
    for name, stated in (
        ("photos", "holds neither a run (run.json) nor a sweep (sweep.json)" if both else "it holds no run.json"),
        ("note.txt", "is a file"),
        ("absent", "no such directory"),
    ):
        said = smarticles(command, tmp_path / name)
        assert said.status == 2
        assert stated in said.err
        assert "; give the directory of a run" in said.err


@pytest.mark.parametrize("command", ["render", "measure", "status", "resume"])
def test_a_directory_that_holds_runs_names_one(
    command: str, tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    for name in "ba":
        write_run(tmp_path / "runs" / name)
    said = smarticles(command, tmp_path / "runs")
    assert said.status == 2
    assert said.err.endswith(f"; give a run that it holds, such as {tmp_path / 'runs' / 'a'}\n")


def test_render_draws_a_film_of_a_part_in_fixed_colours(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run, film = write_run(tmp_path / "a", phases=("deposit",) * 3, frames_per_phase=4), tmp_path / "film.webp"
    words = ("--size", "320x240", "--from", "0.5", "--to", "2", "--every", "0.5", "--fps", "20", "--clim", "0:5")
    said = smarticles("render", run, "--output", film, *words)
    assert (said.status, said.out) == (0, f"{film}\n")
    # Nothing is redrawn where there is no terminal; a slow machine prints lines of progress.
    assert all(line.startswith(("drawing", "pictures drawn")) for line in said.err.splitlines())
    with Image.open(film) as images:
        assert (images.n_frames, images.size) == (4, (320, 240))
        images.seek(1)
        images.load()
        assert images.info["duration"] == 50


def test_render_draws_charts_of_series(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    run, chart = write_run(tmp_path / "a"), tmp_path / "chart.pdf"
    said = smarticles("render", run, "--series", "com_height_m,packing_fraction", "--output", chart)
    assert (said.status, said.out) == (0, f"{chart}\n")
    assert chart.read_bytes().startswith(b"%PDF")
    assert smarticles("render", run, "--series", "com_height_m").out == f"{run / 'com_height_m.png'}\n"
    said = smarticles("render", run, "--series", "com_height_m")
    assert said.status == 2
    assert "exists already" in said.err
    assert smarticles("render", run, "--series", "com_height_m", "--overwrite").status == 0
    said = smarticles("render", run, "--series", "height", "--output", tmp_path / "b.svg")
    assert said.status == 2
    assert "no series 'height'; choose one of: " in said.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--fps", "10"), "--fps 10: a picture shows one time; use --time, or write a film: --output film.gif"),
        (
            ("--smarticle", "1", "--output", "a.gif"),
            "--smarticle 1: a single smarticle is drawn in pictures only; leave it out",
        ),
        (("--output", "film.avi"), "'.avi' is no supported format; end the name in .png for a picture"),
        (("--output", "pile.pdf"), "bodies are drawn in pixels (--size 4000), and .pdf is for charts (--series)"),
        (("--series", "count", "--view", "top"), "--view: is for pictures of bodies, and --series draws a chart"),
        (("--series", "count", "--forces"), "--forces: is for pictures of bodies, and --series draws a chart"),
        (("--series", "count", "--fps", "10"), "--fps: is for pictures of bodies, and --series draws a chart"),
        (("--clim", "5:1"), "must be LOW:HIGH, two numbers in order, or run: got '5:1'"),
        (("--size", "12y3"), "must be a number of pixels from 1, or two as in 1280x720: got '12y3'"),
    ],
)
def test_render_says_what_has_no_meaning(
    tmp_path: Path, smarticles: Smarticles, words: tuple[str, ...], message: str
) -> None:
    said = smarticles("render", tmp_path, *words)
    assert said.status == 2
    assert message in said.err
