"""Strict reader of YAML, for scenes, sweeps and templates."""

import math
import re
import sys
from itertools import chain
from pathlib import Path
from typing import Any

import yaml

from dem.errors import InputError, shown

# YAML 1.1 takes 1e-3 and 5E2 for text; YAML 1.2 takes them for numbers, as their writers do.
_FLOAT = re.compile(
    r"""[-+]?(?:[0-9][0-9_]*\.[0-9_]*(?:[eE][-+]?[0-9]+)?
        |[0-9][0-9_]*[eE][-+]?[0-9]+
        |\.[0-9][0-9_]*(?:[eE][-+]?[0-9]+)?
        |\.(?:inf|Inf|INF)
        |\.(?:nan|NaN|NAN))\Z""",
    re.VERBOSE,
)
# YAML 1.1 reads 1:30 as 90 and 010 as 8; here both are text, which keys of numbers reject.
_INT = re.compile(r"[-+]?(?:0|[1-9][0-9_]*)\Z")
# Characters of a text, also with all aliases written out. Scenes have up to 5000 and the sweeps of the project up to
# 20 000; the slowest text to read, a list of short items, takes 2 s at this length.
LONGEST = 200_000
_OWN = ("tag:yaml.org,2002:float", "tag:yaml.org,2002:int")


class StrictLoader(yaml.SafeLoader):  # type: ignore[misc]  # PyYAML ships no types
    """SafeLoader that rejects a key given twice and reads `1e-3` as a number."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return the mapping of a node; raise ConstructorError if a key occurs twice, or is a list or mapping."""
        if isinstance(node, yaml.MappingNode):
            self.flatten_mapping(node)
            seen: set[Any] = set()
            for key_node, _ in node.value:
                key = self.construct_object(key_node, deep=True)
                try:
                    problem = f"key {shown(key)} is given twice; keep one of the two" if key in seen else ""
                    seen.add(key)
                except TypeError:
                    problem = f"a key must be plain text or a number: got {shown(key)}"
                if problem:
                    raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        return mapping


StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _OWN]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
StrictLoader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+.0123456789"))
StrictLoader.add_implicit_resolver("tag:yaml.org,2002:int", _INT, list("-+0123456789"))


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file without its byte-order mark, cut off where `load_yaml` rejects its length."""
    with path.open(encoding="utf-8-sig") as file:
        return file.read(LONGEST + 1)


def load_yaml(text: str, loader: type[Any] = StrictLoader) -> Any:
    """Return the data of a YAML text; raise yaml.YAMLError if it is not valid.

    `parse_yaml` does the same, and raises InputError with a message for users.

    The loader is `StrictLoader`, a subclass, or another loader that makes plain data only.
    """
    if len(text) > LONGEST:
        raise yaml.YAMLError(f"more than {LONGEST} characters, which no scene or sweep needs; shorten it")
    reader = loader(text)
    try:
        node = reader.get_single_node()
        # Counted before any data are made, since a few aliases of aliases stand for gigabytes.
        if node is not None and _characters(node, {}) > LONGEST:
            raise yaml.YAMLError(f"more than {LONGEST} characters with all aliases (*) written out; use fewer")
        return None if node is None else reader.construct_document(node)
    except ValueError as error:
        digits = sys.get_int_max_str_digits()
        lengthy = f"Exceeds the limit ({digits} digits)" in str(error)
        # Otherwise the text has a date that does not exist.
        problem = f"a whole number of more than {digits} digits" if lengthy else str(error)
        raise yaml.YAMLError(problem) from error
    except RecursionError as error:
        raise yaml.YAMLError("nested too deeply to read") from error
    finally:
        reader.dispose()


def _characters(node: yaml.Node, known: dict[yaml.Node, float]) -> float:
    """Return about how many characters a node has with all aliases written out; inf if it contains itself.

    `known` has results for nodes that were counted before; it is updated.
    """
    if node not in known:
        known[node] = math.inf  # of a node that contains itself
        if isinstance(node, yaml.ScalarNode):
            known[node] = 1 + len(node.value)
        else:
            parts = chain.from_iterable(node.value) if isinstance(node, yaml.MappingNode) else node.value
            known[node] = 1 + sum(_characters(part, known) for part in parts)
    return known[node]


def parse_yaml(text: str, source: str, loader: type[StrictLoader] = StrictLoader) -> Any:
    """Return the data of a YAML text; raise InputError with the text's name, `source`, and the line."""
    try:
        return load_yaml(text, loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = str(error.problem or error.context)
        if "'\\t'" in problem:
            problem = "a tab; YAML is indented and spaced by blanks"
        msg = f"{source}{where}: not valid YAML: {problem}" + ("" if ";" in problem else "; correct this line")
    except yaml.YAMLError as error:
        problem = " ".join(str(error).split())
        msg = f"{source}: not valid YAML: {problem}" + ("" if ";" in problem else "; correct the file")
    raise InputError(msg)
