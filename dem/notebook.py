"""Show scenes, runs and frames in notebooks, as a table of facts and a picture."""

import base64
from collections.abc import Iterable
from functools import singledispatch
from html import escape

from dem.errors import InputError, RunError

Facts = Iterable[tuple[str, str]]  #: Rows of a table: name and value


@singledispatch
def picture_of(_shown: object) -> bytes | None:
    """Return a picture of an object as PNG; None if there is none.

    The simulator draws nothing. A package that draws registers a function for each type that it can draw.
    """
    return None


class Shown:
    """Base of objects that a notebook shows as a table and a picture."""

    def _facts(self) -> Facts:
        """Yield names and values for the table."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        facts = []
        try:
            for fact in self._facts():
                facts.append(fact)
        except (InputError, RunError) as error:
            facts.append(("problem", str(error)))
        rows = (
            f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(value)}</td></tr>'
            for name, value in facts
        )
        return beside(f"<table>{''.join(rows)}</table>", picture_of(self))


def beside(table: str, picture: bytes | None) -> str:
    """Return HTML of a table with a picture, a PNG, to its right; None: no picture."""
    if picture is None:
        return table
    image = f'<img alt="picture" src="data:image/png;base64,{base64.b64encode(picture).decode()}">'
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start">{table}{image}</div>'


def bodies_text(count: int, numbers: dict[str, int], aspect_ratio: float) -> str:
    """Return how many bodies there are, of each shape; no shapes: smarticles with this l/w."""
    if not numbers:
        return f"{count} smarticle{'s' * (count != 1)}, l/w = {aspect_ratio:g}"
    return f"{count}: {', '.join(f'{number} {shape}' for shape, number in numbers.items())}"
