"""HTML of a report: one file that asks for nothing from outside and runs no script."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from dem.errors import InputError

MOST_ROWS = 200  #: Of a table on a page

Section = tuple[str, Sequence[Markup]]  #: Title and blocks; a section without blocks is left out

_MIMES = {".png": "image/png", ".svg": "image/svg+xml", ".webp": "image/webp"}
_NUMBER = re.compile(r"[+−-]?[\d.]+(e[+-]?\d+)?( ± [\d.e+-]+)?( %)?|[-–]?")

# Every text of a run is data, and escaped.
_environment = jinja2.Environment(
    loader=jinja2.FileSystemLoader(Path(__file__).parent),
    autoescape=True,
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_environment.filters["anchor"] = lambda title: re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
_blocks: Any = _environment.get_template("blocks.html.j2").module


def page(title: str, about: str, lead: Iterable[tuple[str, str]], sections: Iterable[Section], source: Path) -> str:
    """Return a whole page.

    Args:
        about: what it is of: "run", "sweep", "study", "results of a study".
        lead: the most important facts, label and value.
        source: the directory that it is made from.
    """
    try:
        made = f"smarticles {version('smarticles')}"
    except PackageNotFoundError:
        made = "smarticles"
    return _environment.get_template("page.html.j2").render(
        title=title,
        about=about,
        lead=lead,
        sections=[(name, blocks) for name, blocks in sections if blocks],
        footer=f"Made by {made} from {source.resolve().name}.",
    )


def words(*lines: str, tone: str = "plain") -> Markup:
    """Return paragraphs; `tone` is "plain", "note" or "warning"."""
    return Markup(_blocks.words(lines, tone))


def table(caption: str, header: Sequence[Any], rows: Iterable[Sequence[Any]], *, folded: bool = False) -> Markup:
    """Return a table; a folded one shows its caption until it is opened."""
    cells = [[word(value) for value in row] for row in rows]
    numeric = [numbers([row[k] for row in cells]) for k in range(len(header))]
    left_out = max(len(cells) - MOST_ROWS, 0)
    return Markup(_blocks.table(caption, header, cells[:MOST_ROWS], numeric, left_out, folded))


def listing(caption: str, text: str, *, folded: bool = False) -> Markup:
    """Return a text as it stands, such as a scene."""
    return Markup(_blocks.listing(caption, text, folded))


def figure(caption: str, alt: str, picture: str, kind: str) -> Markup:
    """Return a picture.

    Args:
        alt: what it shows.
        kind: "chart", of which the colours are turned round on a dark page; "card", on a light ground; "card wide".
    """
    return Markup(_blocks.figure(caption, alt, picture, kind))


def turntable(caption: str, alt: str, views: Sequence[str]) -> Markup:
    """Return `views` from equal angles, data addresses, turned by pointer, finger or arrow keys.

    It is a group of radio buttons, one per picture, so that the page needs no script.
    """
    angles = [round(360 * number / len(views)) for number in range(len(views))]
    return Markup(_blocks.turntable(caption, alt, list(zip(views, angles, strict=True))))


def word(value: Any) -> str:
    """Return a value as a cell: four digits of a number, a dash for none."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def numbers(cells: Sequence[str]) -> bool:
    """Return whether a column holds numbers, with errors or percent signs, and dashes."""
    return bool(cells) and all(_NUMBER.fullmatch(cell.strip()) for cell in cells)


def embedded(path: Path) -> str:
    """Return a picture file as an address that holds it.

    Raises:
        InputError: it is no picture, or cannot be read.
    """
    try:
        return address(path.read_bytes(), _MIMES[path.suffix])
    except (KeyError, OSError) as error:
        raise InputError(f"{path}: cannot be put into a report ({error}); use {', '.join(_MIMES)}") from None


def address(content: bytes, mime: str) -> str:
    """Return an address that holds its content."""
    return f"data:{mime};base64,{base64.b64encode(content).decode()}"
