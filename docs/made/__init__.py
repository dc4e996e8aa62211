"""Sphinx extension: generate tables from the code, and render equations as MathML.

A line `<!-- made here: NAME -->` of a page is replaced by the Markdown table NAME of `MADE`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

from made import tables
from made.scene_keys import scene_keys

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

MADE: Mapping[str, Callable[[], str]] = MappingProxyType(
    {
        "command help": tables.command_help,
        "command list": tables.command_list,
        "export fields": tables.export_fields,
        "force fields": tables.force_fields,
        "frame fields": tables.frame_fields,
        "measure columns": tables.measure_columns,
        "packing definitions": tables.packing_definitions,
        "results index": tables.results_index,
        "scene keys": scene_keys,
        "series columns": tables.series_columns,
    }
)
"""Functions that return Markdown tables, by the names of the tables."""

_PLACE = re.compile(r"^<!-- made here: (.+?) -->$", re.MULTILINE)


def filled(text: str) -> str:
    """Return the Markdown of a page with all tables inserted."""
    return _PLACE.sub(lambda place: MADE[place[1]](), text)


def _fill(_app: Sphinx, _name: str, source: list[str]) -> None:
    source[0] = filled(source[0])


def _plain(_app: Sphinx, _what: str, _name: str, _of: object, _options: object, lines: list[str]) -> None:
    """Escape | in docstrings, since |x| is a substitution in reStructuredText."""
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else line.replace("|", "\\|") for line in lines]


_log = logging.getLogger(__name__)


def _mathml(node: nodes.math | nodes.math_block, *, block: bool) -> str:
    text = node.astext()
    try:
        return str(tex2mathml(text, as_block=block))
    except MathError as error:
        _log.warning("equation %r: %s", text, error, location=node)
        return ""


def show_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Render an inline equation as MathML with the LaTeX translator of docutils."""
    translator.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def show_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Render a display equation as MathML."""
    translator.body.append(f'<div class="math">{_mathml(node, block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension with Sphinx."""
    app.connect("source-read", _fill)
    app.connect("autodoc-process-docstring", _plain)
    app.add_html_math_renderer("mathml", inline_renderers=(show_inline, None), block_renderers=(show_block, None))
    # Sphinx does not notice changes of the code behind tables, so `make docs` rebuilds every page.
    return {"parallel_read_safe": True, "parallel_write_safe": True}
