"""README: its pictures are there and small, and its numbers are those of the results that it links."""

import re
from pathlib import Path

import pytest
from pages import REPOSITORY

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
MOST_BYTES = 120_000
NUMBER = re.compile(r"\d+(?:\.\d+)?(?: ± \d+(?:\.\d+)?)?")


def findings() -> list[tuple[str, str, str]]:
    """Return the rows of the table of findings: question, finding and links."""
    _, _, table = README.partition("| --- | --- | --- |\n")
    rows = [re.split(r"(?<!\\) \| ", line.strip("| ")) for line in table.partition("\n\n")[0].splitlines()]
    return [(question, found, links) for question, found, links in rows]


def test_the_findings_are_about_ten() -> None:
    assert len(findings()) == 10


@pytest.mark.parametrize(("question", "found", "links"), findings(), ids=[row[0] for row in findings()])
def test_numbers_of_a_finding_are_in_the_results_that_it_links(question: str, found: str, links: str) -> None:
    pages = [REPOSITORY / target for target in re.findall(r"\]\(([^)]+)\)", links)]
    assert pages, question
    text = " ".join(" ".join(page.read_text(encoding="utf-8").split()) for page in pages)
    for number in NUMBER.findall(found):
        assert re.search(rf"(?<![\d.]){re.escape(number)}(?![\d.]*\d)", text), f"{number}: in none of {links}"


def test_pictures_of_the_readme_are_there_and_small() -> None:
    pictures = [Path(source) for source in re.findall(r'<img src="([^"]+)"', README)]
    assert len(pictures) == 7  # one, and one for each of six lines
    for picture in pictures:
        assert (REPOSITORY / picture).stat().st_size < MOST_BYTES, picture
