"""Charts of series: what is drawn, in which unit, and over which phases."""

from pathlib import Path

import numpy as np
import pytest
from synthetic import SyntheticRun, write_run, write_series

import smarticles
from dem.errors import InputError
from postprocess.report.series import Chart, shade, spans_of
from postprocess.report.series import write_series as write_chart


@pytest.fixture(scope="module")
def pile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five samples a second for 2.5 s; a plate is there from 1.05 s to 2.05 s."""
    kinds = ("deposit", "relax", "relax", "relax")
    directory = write_run(tmp_path_factory.mktemp("runs") / "a", SyntheticRun(phases=kinds, frames_per_phase=1))
    times = np.arange(1, 51) * 0.05
    columns = {
        "time_s": times,
        "phase": np.searchsorted([1.0, 1.5, 2.0], times - 1e-9),
        "com_height_m": 0.01 - 1e-3 * times,
        "packing_fraction": 0.1 * times,
        "plate_z_m": np.where((times > 1.02) & (times < 2.07), 0.010 - 1e-3 * times, np.nan),
        "plate_force_N": np.outer(times, [1.0, 2.0, 3.0]),
    }
    write_series(directory, columns, seed=1)
    return directory


def test_a_series_is_drawn_with_its_unit_over_its_phases(pile: Path) -> None:
    chart = smarticles.plot(pile, "com_height_m")
    (axes,) = chart.axes
    (line,) = axes.lines
    x, y = np.asarray(line.get_data(), dtype=float)
    known = np.isfinite(x)
    assert y[known] == pytest.approx(0.01 - 1e-3 * x[known])
    assert x[known] == pytest.approx(np.arange(1, 51) * 0.05)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "com height [m]")
    assert [text.get_text() for text in axes.texts] == ["deposit", "relax", "relax", "relax"]
    # Every second phase is shaded.
    bands = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches)
    assert np.array(bands) == pytest.approx(np.array([[1.0, 1.5], [2.0, 2.5]]))
    assert spans_of(smarticles.read(pile))[1] == (1.0, 1.5, "relax")


def test_a_run_of_one_sample_has_a_chart(tmp_path: Path) -> None:
    unfinished = SyntheticRun(phases=("deposit",), frames_per_phase=1, status="unfinished")
    directory = write_run(tmp_path / "a", unfinished)
    write_series(directory, {"time_s": np.array([0.1]), "phase": np.array([0]), "com_height_m": np.ones(1)}, seed=1)
    (axes,) = smarticles.plot(directory, "com_height_m").axes
    assert [text.get_text() for text in axes.texts] == ["deposit"]


def test_a_gap_is_no_line_and_a_vector_has_a_curve_for_each_component(pile: Path) -> None:
    chart = smarticles.plot(pile, ["plate_z_m", "plate_force_N", "packing_fraction"])
    plate, force, packing = chart.axes
    x, y = np.asarray(plate.lines[0].get_data(), dtype=float)
    assert np.nanmin(x) == pytest.approx(1.05)
    assert np.nanmax(x) == pytest.approx(2.05)
    assert [line.get_label() for line in force.lines] == ["x", "y", "z"]
    for factor, line in enumerate(force.lines, start=1):
        x, y = np.asarray(line.get_data(), dtype=float)
        assert y[np.isfinite(y)] == pytest.approx(factor * x[np.isfinite(x)])
    assert packing.get_ylabel() == "packing fraction"  # a pure number has no unit
    assert [len(axes.texts) for axes in chart.axes] == [4, 0, 0]


def test_types_of_short_phases_do_not_run_into_each_other() -> None:
    chart = Chart(4.6, 2.3)
    axes = chart.subplots()
    phases = [(0.0, 0.5, "deposit"), (0.5, 0.54, "relax"), (0.54, 0.57, "compress"), (0.57, 0.6, "relax")]
    shade(axes, phases)
    chart.canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == 4
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    assert boxes[0].y0 == boxes[1].y0  # where there is room, one line serves


@pytest.mark.parametrize(("suffix", "begins"), [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")])
def test_charts_are_files_of_any_kind_and_equal_charts_equal_files(
    pile: Path, tmp_path: Path, suffix: str, begins: bytes
) -> None:
    made = [write_chart(pile, ["com_height_m"], output=tmp_path / f"{k}{suffix}").read_bytes() for k in (0, 1)]
    assert made[0].startswith(begins)
    assert made[0] == made[1]
    if suffix == ".svg":
        assert "com height [m]" in made[0].decode()  # letters, not outlines
    if suffix == ".pdf":
        assert b"/Type3" not in made[0]  # which journals reject


def test_a_notebook_shows_a_chart(pile: Path) -> None:
    content = smarticles.plot(pile, "com_height_m")._repr_png_()
    assert content.startswith(b"\x89PNG")
    assert len(content) < 60_000


def test_a_series_that_is_not_there_is_rejected_with_those_that_are(pile: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no series 'height'; choose one of: .*com_height_m"):
        smarticles.plot(pile, "height")
    with pytest.raises(InputError, match=r"no series is named; choose one of: .*com_height_m"):
        smarticles.plot(pile, [])
    with pytest.raises(InputError, match=r"must end in .png or .pdf or .svg: got '.jpg'"):
        write_chart(pile, ["com_height_m"], output=tmp_path / "a.jpg")
    with pytest.raises(InputError, match="time: is for pictures of the pile"):
        smarticles.plot(pile, "com_height_m", time=1.0)  # type: ignore[call-overload]
    (tmp_path / "b.png").touch()
    with pytest.raises(InputError, match="exists already"):
        write_chart(pile, ["com_height_m"], output=tmp_path / "b.png")
