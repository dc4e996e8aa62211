"""Text files in: YAML and CSV read strictly, JSON if it is there."""

from __future__ import annotations

import csv
import difflib
import io
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from dem.errors import InputError

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")

# YAML 1.1 takes 1e-3 and 5E2 for text; everyone who writes them means numbers, as YAML 1.2 does.
_FLOAT = re.compile(
    r"""[-+]?(?:[0-9][0-9_]*\.[0-9_]*(?:[eE][-+]?[0-9]+)?
        |[0-9][0-9_]*[eE][-+]?[0-9]+
        |\.[0-9][0-9_]*(?:[eE][-+]?[0-9]+)?
        |\.(?:inf|Inf|INF)
        |\.(?:nan|NaN|NAN))\Z""",
    re.VERBOSE,
)


class StrictLoader(yaml.SafeLoader):  # type: ignore[misc]  # PyYAML ships no types
    """SafeLoader that refuses a key given twice and reads `1e-3` as a number."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Build a mapping; a repeated key is an error, not the last one's victory."""
        if isinstance(node, yaml.MappingNode):
            self.flatten_mapping(node)
            seen: set[Any] = set()
            for key_node, _ in node.value:
                key = self.construct_object(key_node, deep=True)
                try:
                    repeated = key in seen
                    seen.add(key)
                except TypeError:
                    problem = f"a key must be plain text or a number: got {key!r}"
                    raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark) from None
                if repeated:
                    problem = f"key {key!r} is given twice; keep one of the two"
                    raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        return mapping


StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:float"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
StrictLoader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+.0123456789"))


def read_text(path: Path, what: str) -> str:
    """Text of a file.

    Raises:
        InputError: the file cannot be read, or is not UTF-8 text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        msg = f"{path}: not UTF-8 text (byte {error.start}); a {what} is a text file"
        raise InputError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot read the {what}: {error.strerror}; check the path"
        raise InputError(msg) from error


def parse_yaml(text: str, source: str, loader: type[StrictLoader] = StrictLoader) -> Any:
    """What a YAML text says.

    Args:
        text: the YAML.
        source: what error messages call it.
        loader: the loader class.

    Raises:
        InputError: the text is not YAML; the message names the line.
    """
    try:
        # A SafeLoader underneath: no Python objects can be made.
        return yaml.load(text, Loader=loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        msg = f"{source}{where}: not valid YAML: {error.problem or error.context}; correct this line"
        raise InputError(msg) from error
    except yaml.YAMLError as error:
        msg = f"{source}: not valid YAML: {' '.join(str(error).split())}; correct the file"
        raise InputError(msg) from error
    except RecursionError as error:
        msg = f"{source}: nested too deeply to read; make the file flatter"
        raise InputError(msg) from error


def parse_table(text: str, source: str) -> list[dict[str, int | float | str]]:
    """Rows of a CSV text whose first line names the columns; cells are numbers where they can be.

    Raises:
        InputError: no rows, a bad column name, a row of another length, an empty cell.
    """
    rows = [row for row in csv.reader(io.StringIO(text)) if row]
    if len(rows) < 2:
        msg = f"{source}: the table has no rows; the first line names the columns, rows follow"
        raise InputError(msg)
    header = [name.strip() for name in rows[0]]
    for name in header:
        if not IDENTIFIER.match(name) or header.count(name) > 1:
            msg = (
                f"{source}, line 1: column {name!r} cannot be a variable; column names are "
                "letters, digits and _, each once"
            )
            raise InputError(msg)
    table = []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header) or not all(cell.strip() for cell in row):
            msg = f"{source}, row {number}: expected {len(header)} filled cells ({', '.join(header)}): got {row!r}"
            raise InputError(msg)
        table.append({name: _cell(cell.strip()) for name, cell in zip(header, row, strict=True)})
    return table


def _cell(text: str) -> int | float | str:
    for convert in (int, float):
        try:
            return convert(text)
        except ValueError:
            continue
    return text


def nearest(word: str, known: Iterable[str]) -> str:
    """`did you mean …` where a known word is close, else the list of known words."""
    words = sorted(known)
    close = difflib.get_close_matches(word, words, n=1)
    if close:
        return f"did you mean {close[0]!r}?"
    return f"known: {', '.join(words) or 'none'}"


def read_json(path: Path) -> dict[str, Any] | None:
    """A JSON object, or None where the file is absent, being replaced, or something else."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None
