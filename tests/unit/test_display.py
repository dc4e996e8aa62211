"""Progress where there is no terminal, and text for terminals; `tests/terminal` has the others."""

import io
import time

import pytest

from dem.display import Display, Row, progress_of
from dem.terminal import folded, spelled, spelling


def test_lines_come_after_a_while_and_then_at_intervals() -> None:
    text = io.StringIO()
    with Display(text, interval_s=0.05, patience_s=0.02) as display:
        display.update(Row(label="measured", fraction=0.25, detail="3 of 12", left_s=65.0))
        time.sleep(0.3)
    lines = text.getvalue().splitlines()
    assert 2 <= len(lines) <= 8
    assert set(lines) == {"measured 25 %, 3 of 12, 1:05 left"}


def test_short_work_says_nothing() -> None:
    text = io.StringIO()
    with Display(text) as display:
        display.update(Row(label="quick"))
    assert text.getvalue() == ""


class Slow(io.StringIO):
    """A stream that takes 0.1 s for each text."""

    def write(self, text: str) -> int:
        time.sleep(0.1)
        return super().write(text)


def test_no_line_follows_the_end() -> None:
    text = Slow()
    with Display(text, patience_s=0.01) as display:
        display.update(Row(label="measured"))
        time.sleep(0.05)
    said = text.getvalue()
    assert said == "measured\n"
    time.sleep(0.3)
    assert text.getvalue() == said


def test_steps_estimate_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Row] = []
    monkeypatch.setattr(Display, "update", lambda _, row: seen.append(row))
    times = iter([0.0, 0.0, 0.0, 10.0, 20.0, 30.0])
    monkeypatch.setattr("dem.display.time.monotonic", lambda: next(times))
    with progress_of("measuring") as step:
        for done in (1, 2, 3):  # when the first part began is unknown
            step("runs measured", done, 5)
    assert [row.left_s for row in seen[1:]] == [None, 30.0, 20.0]
    assert seen[-1].fraction == 0.6


def test_spellings_are_ascii_and_readable() -> None:
    text = "⟨N⟩ = 2.5 ± 0.1, φ ≥ 0.1, Γ = 2, 3 µm², l/w × 2, Ångström…"
    spelt = "".join(character if character.isascii() else spelled(character) for character in text)
    assert spelt == "<N> = 2.5 +- 0.1, phi >= 0.1, Gamma = 2, 3 um^2, l/w x 2, Angstrom..."
    assert spelled("中") == r"\u4e2d"


def test_a_stream_writes_spellings_and_gets_its_own_errors_back() -> None:
    stream = io.TextIOWrapper(io.BytesIO(), encoding="latin-1", errors="strict")
    with spelling(stream):
        stream.write("φ = 0.1 µ, \udcff")
        stream.flush()
    written = stream.buffer.getvalue()  # type: ignore[attr-defined]
    assert written == "phi = 0.1 µ, \\udcff".encode("latin-1")
    assert stream.errors == "strict"


def test_folded_lines_keep_columns_and_words() -> None:
    table = "gravity             on   g = 9.81 m/s², phase 0 waits until all are slower than 0.02 m/s"
    assert folded(table, width=60).splitlines() == [
        "gravity             on   g = 9.81 m/s², phase 0 waits until",
        "                         all are slower than 0.02 m/s",
    ]
    error = "smarticles: error: --out runs/a: holds a run; go on with it by --resume, or choose another directory"
    assert folded(error, width=60, at="; ").splitlines() == [
        "smarticles: error: --out runs/a: holds a run;",
        "  go on with it by --resume, or choose another directory",
    ]
    long = "  a " + "x" * 100
    assert folded(long, width=60).splitlines()[-1].strip() == "x" * 100  # a path stays whole
    assert folded("a  b\n\nc", width=10) == "a  b\n\nc"
    assert folded("x" * 500, width=None) == "x" * 500


def test_long_rows_keep_the_time_left_on_a_narrow_terminal() -> None:
    from rich.console import Console  # noqa: PLC0415

    rows = [
        Row(label="a name of a run that is far too long for it", fraction=0.5, detail="x" * 60, left_s=65.0),
        Row(label="3 of 9 runs ended", fraction=0.3, left_s=3700.0),
    ]
    display = Display(io.StringIO(), patience_s=0.0)
    display.update(*rows)
    console = Console(file=io.StringIO(), width=60, force_terminal=False)
    with console.capture() as shown:
        console.print(display._drawing(console))
    first, second = shown.get().splitlines()
    assert first.rstrip().endswith("1:05 left")
    assert "50 %" in first
    assert "…" in first
    assert second.rstrip().endswith("1:01:40 left")
    assert max(len(first.rstrip()), len(second.rstrip())) <= 55  # five columns stay free for ^C
