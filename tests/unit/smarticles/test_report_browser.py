"""The page of a report in a browser: no errors, no requests, nothing cut off on a phone, dark where that is wanted."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from command_cases import WriteRun
from playwright.sync_api import sync_playwright
from scenes import small

from dem.scene.reading import dump_scene
from smarticles.main import main

CHROMIUM = shutil.which("chromium")
PHONE = {"viewport": {"width": 360, "height": 740}, "is_mobile": True, "has_touch": True, "device_scale_factor": 2}
DESK = {"viewport": {"width": 1200, "height": 900}}
DARK = {**DESK, "color_scheme": "dark"}
SHOWN = (
    "[...document.querySelectorAll('.turntable img')]"
    ".flatMap((one, k) => getComputedStyle(one).visibility == 'visible' ? [k] : [])"
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("no browser here: apt-get install chromium, see setup/debian-packages-dev.txt")
    with sync_playwright() as playwright:
        # In containers Chromium's own sandbox has no rights to make one; the pages are ours.
        yield playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])


class Seen:
    """A page in a browser, with its console output and its requests."""

    def __init__(self, browser: Any, file: Path, how: Any) -> None:
        self.page = browser.new_context(**how).new_page()
        self.said: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.said.append(request.url))
        self.page.goto(file.as_uri())
        self.page.wait_for_load_state("networkidle")
        self.said = [text for text in self.said if text != file.as_uri() and not text.startswith("data:")]

    def ask(self, script: str) -> Any:
        return self.page.evaluate(script)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, write_run: WriteRun) -> Path:
    run = write_run(tmp_path_factory.mktemp("pages") / "run")
    (run / "scene.yaml").write_text(dump_scene(small({"count": 12, "engine": "links"})), encoding="utf-8")
    assert main(["report", str(run)]) == 0
    return run / "report.html"


@pytest.mark.parametrize("how", [DESK, PHONE, DARK], ids=["desk", "phone", "dark"])
def test_it_asks_for_nothing_and_shows_every_picture(how: Any, page: Path, browser: Any) -> None:
    seen = Seen(browser, page, how)
    assert seen.said == []
    assert seen.ask("document.images.length") > 24
    assert seen.ask("[...document.images].filter(one => !one.naturalWidth || !one.alt).length") == 0
    # Nothing is wider than the page, also with everything unfolded; wide tables scroll by themselves.
    seen.ask("document.querySelectorAll('details').forEach(one => { one.open = true })")
    assert seen.ask("document.documentElement.scrollWidth") == how["viewport"]["width"]
    ground = seen.ask("getComputedStyle(document.body).backgroundColor")
    assert ground == ("rgb(22, 24, 26)" if how is DARK else "rgb(255, 255, 255)")
    filters = set(seen.ask("[...document.querySelectorAll('.chart img')].map(one => getComputedStyle(one).filter)"))
    assert filters == ({"invert(1) hue-rotate(180deg)"} if how is DARK else {"none"})


def test_the_final_state_is_turned_by_pointer_finger_and_keys(page: Path, browser: Any) -> None:
    seen = Seen(browser, page, DESK)
    table = seen.page.locator(".turntable")
    table.scroll_into_view_if_needed()
    box = table.bounding_box()
    assert seen.ask(SHOWN) == [0]
    for share, number in ((0.99, 23), (0.51, 12), (0.01, 0)):
        seen.page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 3)
        assert seen.ask(SHOWN) == [number]
    seen.page.mouse.move(0, 0)
    table.locator("input").first.focus()
    seen.page.keyboard.press("ArrowLeft")  # all the way round
    assert seen.ask(SHOWN) == [23]
    phone = Seen(browser, page, PHONE)
    table = phone.page.locator(".turntable")
    table.scroll_into_view_if_needed()
    box = table.bounding_box()
    phone.page.touchscreen.tap(box["x"] + 0.51 * box["width"], box["y"] + box["height"] / 3)
    assert phone.ask(SHOWN) == [12]
