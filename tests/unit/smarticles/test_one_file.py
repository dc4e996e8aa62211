"""Commands that read frames give equal results whether a run has its frames in many files or in one."""

import json
import shutil
from pathlib import Path

import pytest
from command_cases import Smarticles, WriteRun
from synthetic import put_into_one_file
from synthetic.forces import pressed, write_forces

from dem.record.run import open_run


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory, write_run: WriteRun) -> tuple[Path, Path]:
    """Two directories of a run named `a`, with frames in many files and in one."""
    many = write_run(tmp_path_factory.mktemp("many") / "a")
    write_forces(many, pressed([(0, 1), (2, -1)], [5.0, 4.0]))
    one = tmp_path_factory.mktemp("one") / "a"
    shutil.copytree(many, one)
    put_into_one_file(one)
    return many, one


def test_frames_and_their_order(pair: tuple[Path, Path]) -> None:
    many, one = (open_run(path).frames for path in pair)
    assert len(one) == len(many)
    assert one.times == pytest.approx(many.times, rel=1e-8)  # frames.pvd has nine digits
    for number in (0, 5, -1):
        assert one[number].vertices.tobytes() == many[number].vertices.tobytes()
        assert one[number].number == many[number].number
    assert [frame.number for frame in one.in_phase(2)] == [frame.number for frame in many.in_phase(2)]
    assert [frame.number for frame in one[3:9:2]] == [3, 5, 7]
    assert len(one.after(float(one.times[4]))) == len(one) - 5


def test_forces_belong_to_frames_by_number(pair: tuple[Path, Path]) -> None:
    for path in pair:
        forces = open_run(path).forces
        assert forces is not None
        assert [forces[k].path.name for k in (0, 7)] == ["force_000000.vtu", "force_000007.vtu"]


@pytest.mark.parametrize("words", [(), ("--frames",)])
def test_measure(pair: tuple[Path, Path], smarticles: Smarticles, words: tuple[str, ...]) -> None:
    said = [smarticles("measure", path, "--json", *words) for path in pair]
    assert [each.status for each in said] == [0, 0]
    many, one = (json.loads(each.out) for each in said)
    assert len(many) == len(one) > 3
    for row, twin in zip(many, one, strict=True):
        assert {**twin, "run": "", "time [s]": 0} == {**row, "run": "", "time [s]": 0}


def test_compare_finds_no_difference(pair: tuple[Path, Path], smarticles: Smarticles) -> None:
    found = json.loads(smarticles("compare", *pair, "--json").out)
    (bits,) = found["bits"].values()
    assert bits["frames"] == bits["compared"] == 16


def test_export_and_render(pair: tuple[Path, Path], smarticles: Smarticles, tmp_path: Path) -> None:
    made = []
    for number, path in enumerate(pair):
        for command in ("export", "render"):
            suffix = "stl" if command == "export" else "png"
            output = tmp_path / f"{number}.{suffix}"
            more = ("--to", "stl") if command == "export" else ("--size", "300x200")
            assert smarticles(command, path, *more, "--output", output).status == 0
            made.append(output.read_bytes())
    assert made[0] == made[2]
    assert made[1] == made[3]


def test_a_damaged_file_ends_each_command_in_one_line(
    pair: tuple[Path, Path], smarticles: Smarticles, tmp_path: Path
) -> None:
    run = tmp_path / "a"
    shutil.copytree(pair[1], run)
    file = run / "frames.vtkhdf"
    for content in (file.read_bytes()[:5000], b""):
        file.write_bytes(content)
        for words in (("measure", run), ("render", run), ("export", run, "--to", "stl"), ("report", run)):
            said = smarticles(*words)
            assert said.status == 2, words
            (line,) = said.err.splitlines()
            assert f"cannot read frames {file}: truncated or not VTKHDF" in line
            assert f"put the file back, or run {run / 'scene.yaml'} anew elsewhere" in line
    file.unlink()
    said = smarticles("measure", run)
    assert said.status == 2
    assert "frames.pvd: No such file or directory, and no frames.vtkhdf either; give the directory of" in said.err
