"""The table of our engines beside the rivals: medians, ratios and what is said of them."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from benchmarks.rivals import __main__ as bench
from benchmarks.rivals import figure, running
from benchmarks.rivals.ours import RESIDUAL
from benchmarks.rivals.settings import ENGINES, OSCILLATE, SETTINGS, SHAKE
from benchmarks.rivals.table import SAME, TENTH, markdown, medians, verdicts
from dem.errors import InputError
from dem.plan.steps import time_step
from dem.scene.reading import parse_scene

NUMBERS = (running.MEAN_DEPTH, running.BOX_DEPTH, running.PHI_REST, running.PHI_END, running.SINKING, running.MEMORY)


def row(engine: str, setting: str, cost: float, depth: float, **more: Any) -> dict[str, Any]:
    known = {"engine": engine, "setting": setting, "activity": SHAKE, "seed": 1, "account": False}
    known |= {running.COUNT: 270, running.SECONDS: 0.4, running.STEP: 1e-4, "version": "v1"}
    return {**known, **dict.fromkeys(NUMBERS, 0.1), running.COST: cost, running.DEPTH: depth, **more}


ROWS = [
    row("links", "standard", 1.0, 1e-4),
    row("links", "standard", 3.0, 2e-4, seed=2),
    row("links", "standard", 2.0, 1e-4, seed=3),
    row("links", "4 N/mm", 6.0, 1e-5),
    row("MuJoCo", "2e-4 s, CG 50, soft", 80.0, 5e-4),
    row("Bullet", "1e-3 s", 3.0, 2e-4),
    row("Rapier", "2e-4 s, stiff", 30.0, 5e-6),
]


def test_seeds_become_medians_with_their_range() -> None:
    table = medians(pd.DataFrame(ROWS))
    assert table["setting"].tolist() == ["standard", "4 N/mm", "2e-4 s, CG 50, soft", "1e-3 s", "2e-4 s, stiff"]
    first = table.iloc[0]
    assert (first["seeds [1]"], first[running.COST], first[running.DEPTH]) == (3, 2.0, 1e-4)
    assert (first["least cost [s/s]"], first["greatest cost [s/s]"]) == (1.0, 3.0)


def test_links_are_compared_by_the_cheapest_that_are_as_good_and_ten_times_as_good() -> None:
    table = medians(pd.DataFrame(ROWS)).set_index("engine")
    # MuJoCo: standard has a fifth of its overlap, and the stiffer ones less than a tenth.
    assert table.loc["MuJoCo", [SAME, TENTH]].tolist() == [40.0, pytest.approx(80 / 6)]
    assert table.loc["Bullet", [SAME, TENTH]].tolist() == [1.5, 0.5]
    assert all(math.isnan(value) for value in table.loc["Rapier", [SAME, TENTH]])
    assert table.loc["links", [SAME, TENTH]].isna().all().all()


def test_what_was_asked_is_answered_with_its_numbers_also_where_it_does_not_hold() -> None:
    said = "\n".join(verdicts(medians(pd.DataFrame(ROWS))))
    assert "40.0 times as cheap as MuJoCo (2e-4 s, CG 50, soft), asked 25: holds; overlap 0.100 against" in said
    assert f"{394 / 88 * 40:.0f} times as cheap as Chrono would be" in said
    assert "cheaper by 0.5 or more (least: Bullet, 1e-3 s), asked more than 1: does not hold" in said
    assert "no setting of links was run with a tenth of the overlap of Rapier, 2e-4 s, stiff" in said
    swung = [{**each, "activity": OSCILLATE} for each in ROWS]
    deep = [{**each, running.DEPTH: 2.1e-3} if each["engine"] == "MuJoCo" else each for each in swung]
    told = "at a twentieth of the overlap of MuJoCo (2e-4 s, CG 50, soft)"
    assert f"{told}, 2.100 mm, links are 40.0 times as cheap, asked 25: holds" in "\n".join(
        verdicts(medians(pd.DataFrame(deep)))
    )
    assert f"{told}, 0.500 mm, links are 13.3 times as cheap, asked 25: does not hold" in "\n".join(
        verdicts(medians(pd.DataFrame(swung)))
    )
    slower = [{**each, running.COST: 10.0} if each["engine"] == "links" else each for each in ROWS]
    said = "\n".join(verdicts(medians(pd.DataFrame(slower))))
    assert "8.0 times as cheap as MuJoCo (2e-4 s, CG 50, soft), asked 25: does not hold" in said
    assert "36 times as cheap as Chrono would be" in said


def test_an_account_is_told_beside_the_run_that_was_timed_without_it() -> None:
    rows = pd.DataFrame([ROWS[0], row("links", "standard", 9.0, 1e-4, account=True, **{RESIDUAL: 0.25}), ROWS[4]])
    table = bench.joined(rows)
    assert table[running.COST].tolist() == [1.0, 80.0]
    assert table[RESIDUAL].tolist()[0] == 0.25
    assert table[RESIDUAL].isna().tolist() == [False, True]


def test_table_and_figure_are_written_from_rows(tmp_path: Path) -> None:
    table = medians(pd.DataFrame([*ROWS, row("MuJoCo", "2e-4 s, CG 50, soft", 90.0, 6e-4, activity=OSCILLATE)]))
    text = markdown(table, ["a note"])
    assert text.count("\n## ") + text.startswith("## ") == 2
    assert "| MuJoCo | 2e-4 s, CG 50, soft | 1 | 80 | 80 | 80 |" in text
    assert text.endswith("- a note\n")
    assert all(file.stat().st_size > 1000 for file in figure.draw(tmp_path / "rivals", table, ["a note"]))


def test_only_what_a_folder_lacks_is_run_and_rows_of_other_piles_are_not_mixed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, str, str, int, bool]] = []

    def run(folder: Path, setting: Any, activity: str, pile: Path, *, seed: int, account: bool, **_: Any) -> Any:
        asked.append((setting.engine, setting.name, activity, seed, account))
        return row(ENGINES[setting.engine].title, setting.name, 1.0, 1e-4, activity=activity, seed=seed)

    monkeypatch.setattr(running, "run", run)
    monkeypatch.setattr(running, "pour", lambda folder, *, count, seed: folder)
    told = argparse.Namespace(seeds=[1, 2], activities=[SHAKE], count=270, seconds=0.4)
    bench.run_all(tmp_path, told, ["links", "yade"])
    links = [each for each in SETTINGS if each.engine == "links"]
    costly = [each for each in SETTINGS if each.engine in ("links", "yade") and each.costly]
    # Each seed once, costly ones the first alone, and the account of the first seed at standard.
    assert len(asked) == 2 * (len(links) + 3) - len(costly) + 2
    assert [each for each in asked if each[4]] == [
        ("links", "standard", SHAKE, 1, True),
        ("yade", "standard", SHAKE, 1, True),
    ]
    asked.clear()
    told.seeds = [1, 2, 3]
    bench.run_all(tmp_path, told, ["links"])
    assert {each[3] for each in asked} == {3}
    told.seconds = 0.2
    with pytest.raises(InputError, match=r"has rows of activity \[s\] 0.4, not 0.2; choose another folder"):
        bench.run_all(tmp_path, told, ["links"])


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda setting: setting.key)
def test_settings_are_valid_and_named_once(setting: Any, tmp_path: Path) -> None:
    assert sum(each.key == setting.key for each in SETTINGS) == 1
    assert setting.engine in ENGINES
    for activity in setting.activities:
        scene = running.scene_of(setting, activity, tmp_path, count=60, seed=1, seconds=0.1, look=0.01, account=False)
        # The pile is checked when it is there.
        scene["phases"][0] = {"type": "deposit"}
        assert 0 < time_step(parse_scene(scene, source="x")) < 1e-3


@pytest.mark.parametrize(("option", "value"), [("--count", "0"), ("--seconds", "0"), ("--engines", "chrono")])
def test_what_cannot_be_run_ends_in_status_2(
    option: str, value: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["rivals", option, value])
    with pytest.raises(SystemExit) as stop:
        bench.main()
    assert stop.value.code == 2
    assert value in capsys.readouterr().err


def test_rows_that_are_there_are_analysed_without_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pd.DataFrame(ROWS).to_csv(tmp_path / "rivals.csv", index=False)
    monkeypatch.setattr(running, "run", lambda *_, **__: pytest.fail("ran"))
    monkeypatch.setattr("sys.argv", ["rivals", "--analyse", "--out", str(tmp_path)])
    assert bench.main() == 0
    assert (tmp_path / "rivals.md").read_text() in capsys.readouterr().out
    origin = json.loads((tmp_path / "rivals.json").read_text())
    assert origin["versions"]["MuJoCo"] == "v1"
    assert (origin["count"], origin["seconds"]) == (270, 0.4)
    assert (tmp_path / "rivals.png").stat().st_size > 1000
    assert len(pd.read_csv(tmp_path / "rivals_medians.csv")) == len(
        {(each["engine"], each["setting"]) for each in ROWS}
    )
