"""The documentation builds without a warning, and its pages need no network."""

import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from pages import DOCS, REPOSITORY
from sphinx.search.en import SearchEnglish

from dem.record.columns import EVERY, FIELDS, MOTOR_FIELDS
from dem.scene.reading import json_schema
from postprocess.measures.registry import registered
from smarticles.main import build_parser

RESULTS = REPOSITORY / "results"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the pages."""
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-m", "sphinx", "-E", "-W", "--keep-going", "-q", "-b", "html", str(DOCS), str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=300, env={**os.environ})
    assert done.returncode == 0, done.stderr
    return folder


class _Loaded(HTMLParser):
    """Addresses that a browser loads by itself to show a page."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        key = {"link": "href", "a": ""}.get(tag, "src")
        if given.get(key) and given.get("rel") not in {"index", "search", "next", "prev"}:
            self.addresses.append(str(given[key]))

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def _pages(site: Path) -> dict[str, _Loaded]:
    found = {}
    for path in sorted(site.rglob("*.html")):
        loaded = _Loaded()
        loaded.feed(path.read_text(encoding="utf-8"))
        found[path.relative_to(site).as_posix()] = loaded
    return found


def test_pages_load_only_local_files(site: Path) -> None:
    pages = _pages(site)
    assert len(pages) > 20
    for name, page in pages.items():
        assert page.addresses, name  # styles at least: the parser found something
        for address in page.addresses:
            assert not re.match(r"(https?:)?//", address), f"{name} loads {address}"
            beside = (site / name).parent / address.partition("?")[0].partition("#")[0]
            assert address.startswith("data:") or beside.is_file(), f"{name}: {address} is not there"
    for path in (*site.rglob("*.css"), *site.rglob("*.js")):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"""(url\(|@import|import\(|fetch\()\s*["']?(https?:)?//""", text), path


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("how-to/functions", ["radial", "distribution"]),
        ("how-to/frames", ["quaternion"]),
        ("how-to/pictures", ["legend"]),
    ],
)
def test_the_search_finds_what_users_look_for(site: Path, page: str, words: list[str]) -> None:
    text = (site / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text[text.index("(") + 1 : text.rindex(")")])
    number, stem = index["docnames"].index(page), SearchEnglish({}).stem
    for word in words:
        found = [index[where].get(stem(word), []) for where in ("terms", "titleterms")]
        assert any(number in (each if isinstance(each, list) else [each]) for each in found), word


def test_equations_are_mathml(site: Path) -> None:
    text = (site / "theory.html").read_text(encoding="utf-8")
    assert text.count('<math xmlns="http://www.w3.org/1998/Math/MathML" display="block"') >= 15
    assert "\\frac" not in text
    assert "MathJax" not in text


def test_reference_has_all_keys_datasets_fields_columns_and_commands(site: Path) -> None:
    pages = {name: " ".join("".join(page.text).split()) for name, page in _pages(site).items()}
    schema = json_schema()
    keys = {key for part in (schema, *schema["$defs"].values()) for key in part["properties"]}
    for page, names in {
        "scene": keys,
        "recorded": {*EVERY, *FIELDS, *MOTOR_FIELDS},
        "measures": {quantity.header for measure in registered() for quantity in measure.quantities},
        "commands": {f"smarticles {name}" for name in build_parser()[1].parsers},
    }.items():
        for name in names:
            assert name in pages[f"reference/{page}.html"], f"{page}: {name}"
    assert "--checkpoint" not in pages["reference/commands.html"]  # the search can fail
    assert "[m/s²]" not in pages["reference/scene.html"]  # units have a column of their own


def test_every_folder_of_results_is_listed_with_its_finding(site: Path) -> None:
    text = "".join(_pages(site)["results.html"].text)
    folders = [folder.name for folder in RESULTS.iterdir() if folder.is_dir()]
    assert len(folders) > 10
    for folder in folders:
        # Not as the beginning of another's name: gravish of gravish-yade.
        assert re.search(rf"results/{re.escape(folder)}(?![\w-])", text), (
            f"results/{folder}/README.md: begin with '# …' and '> the finding, with its numbers'"
        )
