"""The page in a browser: nothing on its console, no request, nothing cut off on a phone, dark where that is wanted."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_cases import WriteRun
from hostile import NAMES, of_entry, spoil
from PIL import Image
from playwright.sync_api import sync_playwright

from smarticles.main import main
from smarticles.sweeps import make_folder

CHROMIUM = shutil.which("chromium")
RUNS = (" ".join(NAMES), " ".join(reversed(NAMES)))
PHONE = {"viewport": {"width": 360, "height": 740}, "is_mobile": True, "device_scale_factor": 2}
DESK = {"viewport": {"width": 1200, "height": 900}}


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("no browser here: apt-get install chromium, see setup/debian-packages-dev.txt")
    with sync_playwright() as playwright:
        # In containers Chromium's own sandbox has no rights to make one; the pages are ours.
        yield playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])


class Seen:
    """A page as a browser has it; everything that it said, and asked for."""

    def __init__(self, browser: Any, file: Path, **how: Any) -> None:
        self.page = browser.new_context(**how).new_page()
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.said.append(dialog.message), dialog.dismiss()))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(file.as_uri())
        self.page.wait_for_load_state("networkidle")
        self.address = file.as_uri()

    def ask(self, script: str) -> Any:
        return self.page.evaluate(script)

    @property
    def outside(self) -> list[str]:
        return [url for url in self.asked if url != self.address and not url.startswith("data:")]

    def picture(self, path: Path) -> np.ndarray:
        self.page.screenshot(path=path, full_page=True)
        with Image.open(path) as image:
            return np.asarray(image.convert("L"), dtype=float)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory, write_run: WriteRun) -> dict[str, Path]:
    """Pages of two runs with all hostile names, and of a sweep: what one of them opens, another might close."""
    folder = tmp_path_factory.mktemp("pages")
    found = {}
    for number, name in enumerate(RUNS):
        run = spoil(write_run(folder / f"run{number}", status="failed", frames_per_phase=1), name)
        assert main(["report", str(run)]) == 0
        found[name] = run / "report.html"
    (folder / "scene.yaml.j2").write_text(
        "{schema_version: 1, seed: 1, count: {{ count }}, name: '{{ name }}', phases: [{type: deposit}, {type: relax}]}"
    )
    (folder / "sweep.yaml").write_text(
        "{schema_version: 1, name: '<script>document.body.dataset.hit = 1</script>', template: scene.yaml.j2,\n"
        ' run_name: "n{{ count }}-{{ loud }}", derived: {loud: "name | length"},\n'
        " points: {grid: {count: [5, 6], name: ['<img src=x onerror=alert(1)>', '</table><h1 id=hit>']}}}"
    )
    swept = make_folder(folder / "sweep.yaml", folder / "sweep", "smarticles sweep <b>x</b>")
    for entry in swept.entries:
        packing = (0.1, 0.1, 0.02 * entry.values["count"], 0.1)
        known = {"count": entry.values["count"], "name": entry.values["name"]}
        of_entry(write_run(swept.run(entry), packing=packing, **known), entry)
    assert main(["report", str(swept.path)]) == 0
    found["sweep"] = swept.path / "report.html"
    return found


@pytest.mark.parametrize("name", [*RUNS, "sweep"], ids=["forth", "back", "sweep"])
def test_it_says_nothing_asks_for_nothing_and_shows_every_picture(
    name: str, pages: dict[str, Path], browser: Any
) -> None:
    for how in (DESK, PHONE, {**DESK, "color_scheme": "dark"}):
        seen = Seen(browser, pages[name], **how)
        assert seen.said == []
        assert seen.outside == []
        assert seen.ask("document.body.dataset.hit") is None
        assert seen.ask("document.scripts.length + document.querySelectorAll('#hit').length") == 0
        assert seen.ask("[...document.images].filter(one => !one.naturalWidth || !one.alt).length") == 0
        assert seen.ask("document.images.length") >= 1
        # Nothing is wider than the page, also with everything unfolded; wide tables scroll by themselves.
        seen.ask("document.querySelectorAll('details').forEach(one => { one.open = true })")
        assert seen.ask("document.documentElement.scrollWidth <= window.innerWidth")
        assert seen.ask("document.documentElement.scrollWidth") == how["viewport"]["width"]
    if name != "sweep":
        assert name in seen.ask("document.querySelector('h1').textContent")


SHOWN = (
    "[...document.querySelectorAll('.turntable img')]"
    ".flatMap((one, k) => getComputedStyle(one).visibility == 'visible' ? [k] : [])"
)


@pytest.mark.parametrize("name", [RUNS[0], "sweep"], ids=["run", "sweep"])
def test_the_final_state_is_turned_by_pointer_finger_and_keys(name: str, pages: dict[str, Path], browser: Any) -> None:
    seen = Seen(browser, pages[name], **DESK)
    table = seen.page.locator(".turntable")
    table.scroll_into_view_if_needed()
    box = table.bounding_box()
    assert seen.ask(SHOWN) == [0]
    assert len(set(seen.ask("[...document.querySelectorAll('.turntable img')].map(one => one.src)"))) == 24
    places = seen.ask("[...document.querySelectorAll('.turntable img')].map(one => one.getBoundingClientRect().x)")
    assert set(places) == {box["x"]}
    for share, number in ((0.99, 23), (0.51, 12), (0.01, 0)):
        seen.page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 3)
        assert seen.ask(SHOWN) == [number]
    seen.page.mouse.move(0, 0)
    table.locator("input").first.focus()
    seen.page.keyboard.press("ArrowLeft")  # all the way round
    assert seen.ask(SHOWN) == [23]
    phone = Seen(browser, pages[name], **PHONE, has_touch=True)
    table = phone.page.locator(".turntable")
    table.scroll_into_view_if_needed()
    box = table.bounding_box()
    phone.page.touchscreen.tap(box["x"] + 0.51 * box["width"], box["y"] + box["height"] / 3)
    assert phone.ask(SHOWN) == [12]
    assert (seen.said, phone.said, seen.outside, phone.outside) == ([], [], [], [])
    assert pages[name].stat().st_size < 15e6


def test_it_is_dark_where_that_is_wanted(pages: dict[str, Path], browser: Any, tmp_path: Path) -> None:
    light, dark = (
        Seen(browser, pages[RUNS[0]], **DESK, color_scheme=scheme).picture(tmp_path / f"{scheme}.png")
        for scheme in ("light", "dark")
    )
    # Pictures of piles stand on a light card in both.
    assert np.median(light) > 240
    assert np.median(dark) < 40


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_from_its_ground(scheme: str, pages: dict[str, Path], browser: Any) -> None:
    """Contrast as WCAG 2.1 measures it; AA asks for 4.5."""
    seen = Seen(browser, pages["sweep"], **DESK, color_scheme=scheme)
    ground = seen.ask("getComputedStyle(document.body).backgroundColor")
    for place in ("body", "a", "caption", "footer", "dt", "figcaption", "summary", "th"):
        ink = seen.ask(f"getComputedStyle(document.querySelector('{place}')).color")
        assert contrast(ink, ground) >= 4.5, place


def contrast(one: str, other: str) -> float:
    first, second = sorted((luminance(one), luminance(other)), reverse=True)
    return (first + 0.05) / (second + 0.05)


def luminance(colour: str) -> float:
    channels = np.array([int(word) for word in colour.removeprefix("rgb(").removesuffix(")").split(",")]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_charts_are_turned_round_on_a_dark_page(pages: dict[str, Path], browser: Any) -> None:
    script = "[...document.querySelectorAll('.chart img')].map(one => getComputedStyle(one).filter)"
    light, dark = (set(Seen(browser, pages["sweep"], **DESK, color_scheme=s).ask(script)) for s in ("light", "dark"))
    assert (light, dark) == ({"none"}, {"invert(1) hue-rotate(180deg)"})
