"""What the pages do not say by hand: tables made from the code when the site is built, and equations as MathML.

A page has a line `<!-- made here: NAME -->`; in its place comes the Markdown that the function of that name returns.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from made.columns import export_fields, force_fields, frame_fields, measure_columns, packing_definitions, series_columns
from made.commands import command_help, command_list
from made.findings import results_index
from made.mathml import show_block, show_inline
from made.scene_keys import scene_keys

if TYPE_CHECKING:
    from sphinx.application import Sphinx

MADE: Mapping[str, Callable[[], str]] = MappingProxyType(
    {
        "command help": command_help,
        "command list": command_list,
        "export fields": export_fields,
        "force fields": force_fields,
        "frame fields": frame_fields,
        "measure columns": measure_columns,
        "packing definitions": packing_definitions,
        "results index": results_index,
        "scene keys": scene_keys,
        "series columns": series_columns,
    }
)
"""What a page may ask for, and the function that writes it."""

_PLACE = re.compile(r"^<!-- made here: (.+?) -->$", re.MULTILINE)


def filled(text: str) -> str:
    """A page with everything in it that is made.

    Raises:
        KeyError: it asks for something that nothing makes.
    """
    return _PLACE.sub(lambda place: MADE[place[1]](), text)


def _fill(_app: Sphinx, _name: str, source: list[str]) -> None:
    source[0] = filled(source[0])


def _plain(_app: Sphinx, _what: str, _name: str, _of: object, _options: object, lines: list[str]) -> None:
    """Docstrings are plain text with |x| in it, which would be a substitution of reStructuredText."""
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else line.replace("|", "\\|") for line in lines]


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this an extension of Sphinx."""
    app.connect("source-read", _fill)
    app.connect("autodoc-process-docstring", _plain)
    app.add_html_math_renderer("mathml", inline_renderers=(show_inline, None), block_renderers=(show_block, None))
    # What is made depends on the code, which Sphinx does not watch: `make docs` builds every page anew.
    return {"parallel_read_safe": True, "parallel_write_safe": True}
