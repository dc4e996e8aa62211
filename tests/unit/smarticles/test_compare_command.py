"""compare: what differs between two runs or two sweeps."""

import csv
import json
import math
import shutil
from pathlib import Path

import h5py
import pytest
from command_cases import SCENE, Smarticles, WriteRun

PHI = "phi second-highest-com [-]"


def words_of(said_out: str) -> list[str]:
    return [" ".join(line.split()) for line in said_out.splitlines()]


def test_a_run_equals_its_copy_until_that_loses_its_series(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "a")
    shutil.copytree(run, tmp_path / "b")
    said = smarticles("compare", run, tmp_path / "b")
    assert (said.status, said.err) == (0, "")
    assert "identical bits: yes, all of the series and 16 frames" in said.out
    assert {"scene: no difference", "versions: no difference", "measures: no difference"} <= {*said.out.splitlines()}
    (tmp_path / "b" / "series.h5").unlink()
    said = smarticles("compare", run, tmp_path / "b")
    assert "identical bits: no, one run has more samples, columns or frames, 16 of 16 frames are equal" in said.out


def test_frames_are_compared_at_equal_times(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    run, other = write_run(tmp_path / "a"), tmp_path / "b"
    shutil.copytree(run, other)
    # As a run of an older version, which lacks the frame at the end of a phase.
    listed = (other / "frames.pvd").read_text(encoding="utf-8").splitlines(keepends=True)
    (other / "frames.pvd").write_text("".join(line for line in listed if "frame_000003" not in line), encoding="utf-8")
    said = smarticles("compare", run, other)
    assert "identical bits: no, one run has more samples, columns or frames, 15 of 15 frames are equal" in said.out


def test_what_differs_is_listed_key_by_key(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    one = write_run(tmp_path / "a")
    other = write_run(tmp_path / "b", packing=(0.1, 0.105, 0.15, 0.132), shake_time=10.0)
    manifest = json.loads((other / "run.json").read_text())
    manifest["versions"]["numpy"] = "3"
    (other / "run.json").write_text(json.dumps(manifest))
    lines = words_of(smarticles("compare", one, other).out)
    assert "phases.2.duration_s 20.0 10.0" in lines
    assert "numpy 2 3" in lines
    # φ of a made-up run is what was asked for; its frames scatter by 0.2 % about it.
    assert any(line.startswith("shake φ 0.1300 0.1500 0.0200 ") for line in lines)
    assert any("identical bits: no, the series differ from t = " in line for line in lines)


def test_a_single_bit_is_seen(tmp_path: Path, write_run: WriteRun, smarticles: Smarticles) -> None:
    one = write_run(tmp_path / "a")
    shutil.copytree(one, tmp_path / "b")
    with h5py.File(tmp_path / "b" / "series.h5", "a") as file:
        value = file["com_height_m"][30]
        file["com_height_m"][30] = math.nextafter(value, 1.0)
        at = file["time_s"][30]
    said = smarticles("compare", one, tmp_path / "b", "--json")
    found = json.loads(said.out)
    assert found["identical"] is False
    (bits,) = found["bits"].values()
    assert bits["differs_at"] == at
    assert (bits["frames"], bits["compared"]) == (16, 16)


def test_json_and_table_have_all_measures_with_the_error_of_the_difference(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    runs = [write_run(tmp_path / name, packing=(0.1, 0.1, phi, 0.1)) for name, phi in (("a", 0.12), ("b", 0.14))]
    table = tmp_path / "table.csv"
    found = json.loads(smarticles("compare", *runs, "--json", "--table", table).out)
    (row,) = [one for one in found["measures"] if one["quantity"] == PHI and one["phase type"] == "shake"]
    assert row["B - A"] == pytest.approx(0.02, rel=1e-3)
    single = json.loads(smarticles("measure", *runs, "--json").out)
    errors = [one["phi second-highest-com SE [-]"] for one in single if one["phase type"] == "shake"]
    assert row["SE of B - A"] == pytest.approx(math.hypot(*errors))
    with table.open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(found["measures"])
    assert "exists; choose another name" in smarticles("compare", *runs, "--table", table).err


def test_sweeps_are_compared_run_by_run_and_group_by_group(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    for name, shift in (("one", 0.0), ("two", 0.02)):
        smarticles("sweep", sweep_file, "--out", tmp_path / name)
        write_run(tmp_path / name / "runs" / "n5", count=5)
        write_run(tmp_path / name / "runs" / "n6", count=6, packing=(0.1, 0.1, 0.12 + shift, 0.1))
        sweep_file.write_text(sweep_file.read_text().replace("[5, 6]", "[5, 6, 7]"))
    write_run(tmp_path / "two" / "runs" / "n7", count=7)
    said = smarticles("compare", tmp_path / "one", tmp_path / "two")
    lines = words_of(said.out)
    assert "only in B: n7" in lines
    assert "identical bits: 1 of 2 runs that both sweeps have" in lines
    assert any(line.startswith("6 shake φ 0.1200 0.1400 0.0200") for line in lines)
    assert any(line.startswith("5 shake φ 0.1300 0.1300 0.0000") for line in lines)


def test_sweeps_with_different_constants_are_compared_at_equal_variables(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    text = sweep_file.read_text()
    for name, friction in (("a", 0.1), ("b", 0.2)):
        sweep_file.write_text(f"{text}constants: {{friction: {friction}}}\n")
        template = tmp_path / "scene.yaml.j2"
        template.write_text(SCENE + "contact: {friction_wall: {{ friction }}}\n")
        smarticles("sweep", sweep_file, "--out", tmp_path / name)
        for count in (5, 6):
            write_run(tmp_path / name / "runs" / f"n{count}", count=count)
    found = json.loads(smarticles("compare", tmp_path / "a", tmp_path / "b", "--json").out)
    assert {row["count"] for row in found["measures"]} == {5, 6}
    assert "friction" not in found["measures"][0]
    assert found["scene"]["friction"] == [0.1, 0.2]


def test_a_sweep_with_a_run_that_has_not_begun_is_not_identical(
    tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    for name, counts in (("one", (5, 6)), ("two", (5,))):
        smarticles("sweep", sweep_file, "--out", tmp_path / name)
        for count in counts:
            write_run(tmp_path / name / "runs" / f"n{count}", count=count)
    found = json.loads(smarticles("compare", tmp_path / "one", tmp_path / "two", "--json").out)
    assert (found["identical"], found["only"]) == (False, {"A": ["n6"], "B": []})
    write_run(tmp_path / "two" / "runs" / "n6", count=6)
    found = json.loads(smarticles("compare", tmp_path / "one", tmp_path / "two", "--json").out)
    assert (found["identical"], found["only"]) == (True, {"A": [], "B": []})
