"""Run the commands of README, tutorial, how-tos and gallery, page by page, in an empty folder.

RENEW_PICTURES=1 pytest tests/docs/test_commands_run.py      takes the pictures that the pages' commands made
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pages import DOCS, REPOSITORY, RUN, SHOWN, WRITTEN, Block, Page, pages
from PIL import Image
from terminals import Terminal

from smarticles.main import build_parser

PAGES = {page.name: page for page in pages()}
FOLLOWED = [name for name, page in PAGES.items() if any(block.language in RUN for block in page.blocks)]
TYPED = {"README.md": (80, 24), "docs/tutorial.md": (200, 50)}
"""Pages whose commands are typed into terminals of these columns and rows."""
COLOURS = 128
"""Colours of a committed picture: half the size of all of them, and no visible difference."""


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return an environment in which `smarticles` and `python` are those of this checkout."""
    folder = tmp_path_factory.mktemp("bin")
    for name, module in (("smarticles", "-m smarticles"), ("python", "")):
        script = folder / name
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n', encoding="utf-8")
        script.chmod(0o755)
    paths = os.pathsep.join(filter(None, (str(REPOSITORY), os.environ.get("PYTHONPATH"))))
    path = os.pathsep.join((str(folder), os.environ["PATH"]))
    return {**os.environ, "PATH": path, "PYTHONPATH": paths, "MPLBACKEND": "Agg"}


def _do(page: Page, block: Block, folder: Path, words: dict[str, str]) -> None:
    if block.language in WRITTEN:
        assert block.file is not None
        (folder / block.file).write_text(block.text, encoding="utf-8")
        return
    command = ["bash", "-euo", "pipefail", "-c", block.text]
    if block.language == "python":
        command = [sys.executable, "-W", "error", "-c", block.text]
    if page.name in TYPED:
        _type(page, block, command, folder, words)
        return
    done = subprocess.run(command, cwd=folder, env=words, capture_output=True, text=True, check=False, timeout=900)
    said = f"{page.name}:{block.line} exit status {done.returncode}\n{block.text}\n{done.stdout[-2000:]}\n{done.stderr}"
    assert done.returncode == 0, said
    assert "Traceback" not in done.stderr, said


def _type(page: Page, block: Block, command: list[str], folder: Path, words: dict[str, str]) -> None:
    """Run a block in a terminal, where a person meets bars, tables that fit, and colours."""
    columns, rows = TYPED[page.name]
    with Terminal(command, folder=folder, columns=columns, rows=rows, environment=words) as terminal:
        status = terminal.end(900)
        said = "\n".join([f"{page.name}:{block.line} exit status {status}", block.text, *terminal.history])
    assert status == 0, said
    assert not re.search("Traceback|internal error", terminal.raw), said
    assert not any("━" in line for line in terminal.lines), said  # no bar is left behind


@pytest.mark.parametrize("name", FOLLOWED)
def test_commands_of_a_page_run(name: str, tmp_path: Path, words: dict[str, str]) -> None:
    page = PAGES[name]
    for block in page.blocks:
        if block.reason is None and block.language not in SHOWN:
            _do(page, block, tmp_path, words)
    for picture in page.made:
        _compare(picture, tmp_path / picture.name)


def _compare(picture: Path, made: Path) -> None:
    """Compare a committed picture with the one that the commands made; piles differ between processors."""
    with Image.open(made) as image:
        new = image.convert("RGB")
    if os.environ.get("RENEW_PICTURES"):
        new.quantize(COLOURS).save(picture, optimize=True)
        return
    with Image.open(picture) as image:
        committed = image.convert("RGB")
    assert committed.size == new.size, picture
    (old, old_place), (now, now_place) = (_drawn(image) for image in (committed, new))
    assert now > 0.01, f"{made}: nothing on it"
    # A shaken pile differs between processors, from the first contact that rounds otherwise. Its share of the picture
    # and its place do not: a blank sheet, another view or another scene differ by more.
    assert now == pytest.approx(old, rel=0.35), f"{picture}: not what the commands make"
    assert now_place == pytest.approx(old_place, abs=0.12), f"{picture}: not where the commands draw it"


def _drawn(image: Image.Image) -> tuple[float, NDArray[np.float64]]:
    """Return the share of a picture that is drawn on, and its middle as shares of width and height."""
    coarse = np.asarray(image.resize((64, 64), Image.Resampling.BOX), dtype=np.float64)
    paper = np.median(np.concatenate([coarse[0], coarse[-1], coarse[:, 0], coarse[:, -1]]), axis=0)
    drawn = np.abs(coarse - paper).max(axis=2) > 12
    return float(drawn.mean()), np.argwhere(drawn).mean(axis=0)[::-1] / 64 if drawn.any() else np.full(2, np.nan)


def test_every_block_is_run_or_has_its_reason() -> None:
    left = []
    for page in PAGES.values():
        for block in page.blocks:
            where = f"{page.name}:{block.line}"
            assert block.language in RUN | WRITTEN | SHOWN, f"{where}: language {block.language!r}"
            if block.reason is None:
                assert block.language not in WRITTEN or block.file, f"{where}: begin with '# NAME.{block.language}'"
            else:
                assert block.language not in SHOWN, f"{where}: is never run, so that it needs no reason"
                left.append(f"{where}: {block.reason}")
    print("\n".join(["not run:", *left]))  # what `pytest -rP` lists
    assert len(left) < 0.3 * sum(len(page.blocks) for page in PAGES.values()), "too much is left out"


def test_commands_named_in_the_text_exist() -> None:
    _, commands = build_parser()
    for page in PAGES.values():
        for named in re.findall(r"`smarticles ([a-z]+)", page.text):
            assert named in commands.parsers, f"{page.name}: `smarticles {named}`"


def test_every_committed_picture_is_made_by_its_page_and_shown() -> None:
    made = {picture for page in PAGES.values() for picture in page.made}
    for picture in DOCS.glob("pictures/**/*.png"):
        assert picture in made, f"{picture}: no page makes it"
        shown = f"{picture.parent.name}/{picture.name}"
        assert any(shown in page.text for page in PAGES.values()), f"{picture}: no page shows it"
        assert picture.stat().st_size < 100_000, f"{picture}: {picture.stat().st_size} bytes"
