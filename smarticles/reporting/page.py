"""A page as data, and its HTML: one file that asks for nothing from outside and runs no script."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from pathlib import Path

import jinja2

TEMPLATE = "page.html.j2"
PICTURES = ("figure", "turntable")
"""Kinds of blocks that are pictures."""
MOST_ROWS = 200
"""Of a table on a page."""


@dataclass(frozen=True, kw_only=True)
class Words:
    """Paragraphs.

    Attributes:
        lines: one each.
        tone: "plain", "note" for an aside, "warning" for what must not be overlooked.
    """

    lines: Sequence[str]
    tone: str = "plain"
    kind: str = field(default="words", init=False)


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table whose cells are texts already.

    Attributes:
        caption: what it is.
        header: names of the columns, with units.
        rows: cells.
        folded: whether only its caption is shown until it is asked for.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    folded: bool = False
    kind: str = field(default="table", init=False)

    @cached_property
    def numeric(self) -> list[bool]:
        """By column, whether its cells are numbers, to be set to the right."""
        return [bool(self.rows) and all(_is_number(row[k]) for row in self.rows) for k in range(len(self.header))]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture.

    Attributes:
        caption: below it.
        alt: what it shows, for who cannot see it.
        light: data address of the picture.
        dark: the same for a dark page; None: the one is shown on a light card.
        wide: whether it stands alone, and not beside its neighbours.
    """

    caption: str
    alt: str
    light: str
    dark: str | None = None
    wide: bool = False
    kind: str = field(default="figure", init=False)


@dataclass(frozen=True, kw_only=True)
class Turntable:
    """One thing from all around, that is turned by hand: by the mouse over it, a finger on it, or the arrow keys.

    It is a group of radio buttons, one per picture, so that the page needs no script.

    Attributes:
        caption: below it.
        alt: what it shows, for who cannot see it.
        views: data addresses of pictures of one size, at equal angles, the first one from the front.
        name: of the group, unique on the page.
    """

    caption: str
    alt: str
    views: Sequence[str]
    name: str
    kind: str = field(default="turntable", init=False)

    @property
    def angles(self) -> list[int]:
        """Angle of each view from the front [degree]."""
        return [round(360 * number / len(self.views)) for number in range(len(self.views))]


@dataclass(frozen=True, kw_only=True)
class Listing:
    """A text as it stands, such as a scene.

    Attributes:
        caption: what it is.
        text: the text.
        folded: whether only its caption is shown until it is asked for.
    """

    caption: str
    text: str
    folded: bool = False
    kind: str = field(default="listing", init=False)


Block = Words | Table | Figure | Turntable | Listing


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page under a heading of its own."""

    title: str
    blocks: Sequence[Block]

    @property
    def anchor(self) -> str:
        """Where links within the page lead."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")

    @property
    def parts(self) -> list[list[Block]]:
        """The blocks, pictures that follow each other together: they stand side by side where there is room."""
        return [list(part) for _, part in groupby(self.blocks, key=lambda block: block.kind in PICTURES)]


@dataclass(frozen=True, kw_only=True)
class Page:
    """Everything that a page tells.

    Attributes:
        title: its heading.
        about: what it is of: "run", "sweep", "study", "results".
        lead: the most important facts, label and value.
        sections: in order; those without blocks are left out.
        footer: who made it, and of what.
    """

    title: str
    about: str
    lead: Sequence[tuple[str, str]]
    sections: Sequence[Section]
    footer: str


def to_html(page: Page) -> str:
    """The page as HTML; every text in it is data and escaped."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    sections = [section for section in page.sections if section.blocks]
    return environment.get_template(TEMPLATE).render(
        page=page, sections=sections, most_rows=MOST_ROWS, pictures=PICTURES
    )


def _is_number(cell: str) -> bool:
    text = cell.strip()
    return text in ("", "-", "–") or bool(re.match(r"[+−-]?[\d.]+(e[+-]?\d+)?( ± [\d.e+-]+)?( %)?\Z", text))
