"""HTML of a report: one file without scripts and without links to other files."""

import base64
import re
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from dem.errors import InputError
from smarticles.command_line import format_cell

MAX_ROWS = 200  #: Rows shown of a table; further rows are counted only

Section = tuple[str, Sequence[Markup]]  #: Title and blocks

_MIMES = {".png": "image/png", ".svg": "image/svg+xml", ".webp": "image/webp"}
_NUMBER = re.compile(r"[+−-]?[\d.]+(e[+-]?\d+)?( ± [\d.e+-]+)?( %)?|[-–]?")

# autoescape: texts of a run may contain HTML.
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
    """Return an HTML page about a directory, `source`, of the kind `about`, such as "run" or "sweep".

    `lead` are label and value of the most important facts, which come first. Sections have title and blocks; a section
    without blocks is left out.
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
    """Return paragraphs, one for each of the lines; `tone` is "plain", "note" or "warning"."""
    return Markup(_blocks.words(lines, tone))


def table(caption: str, header: Sequence[Any], rows: Iterable[Sequence[Any]], *, folded: bool = False) -> Markup:
    """Return a table of at most `MAX_ROWS` rows; `folded`: show only its caption until a click."""
    cells = [[format_cell(value) for value in row] for row in rows]
    # Dashes and numbers, with or without error and percent sign.
    numeric = [bool(cells) and all(_NUMBER.fullmatch(row[k].strip()) for row in cells) for k in range(len(header))]
    left_out = max(len(cells) - MAX_ROWS, 0)
    return Markup(_blocks.table(caption, header, cells[:MAX_ROWS], numeric, left_out, folded))


def listing(caption: str, text: str, *, folded: bool = False) -> Markup:
    """Return preformatted text, such as a scene file; `folded`: show only the caption until a click."""
    return Markup(_blocks.listing(caption, text, folded))


def figure(caption: str, alt: str, picture: str, kind: str) -> Markup:
    """Return a picture with caption.

    `alt` describes the picture, a data URL, for readers who cannot see it. The kind is "chart" (colours are inverted on
    a dark page), "card" (light background) or "card wide".
    """
    return Markup(_blocks.figure(caption, alt, picture, kind))


def turntable(caption: str, alt: str, views: Sequence[str]) -> Markup:
    """Return a picture that the reader turns by pointer, touch or arrow keys.

    `views` are data URLs from equally spaced angles. The HTML is a group of radio buttons, one per view, so that the
    page needs no script.
    """
    angles = [round(360 * number / len(views)) for number in range(len(views))]
    return Markup(_blocks.turntable(caption, alt, list(zip(views, angles, strict=True))))


def embedded(path: Path) -> str:
    """Return a picture file as a data URL; raise InputError for an unknown suffix or an unreadable file."""
    try:
        return data_url(path.read_bytes(), _MIMES[path.suffix])
    except (KeyError, OSError) as error:
        raise InputError(f"{path}: cannot be put into a report ({error}); use {', '.join(_MIMES)}") from None


def data_url(content: bytes, mime: str) -> str:
    """Return a data URL with the content of a file of the media type `mime`, such as `image/png`."""
    return f"data:{mime};base64,{base64.b64encode(content).decode()}"
