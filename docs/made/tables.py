"""Markdown tables of recorded data, fields, measures, commands and results."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from postprocess.report.tables import table_lines

RESULTS = Path(__file__).resolve().parents[2] / "results"
_WIDTH = "100"
"""Width of the printed help [characters], independent of the terminal."""

_SETS = (
    ("In every scene", "COLUMNS"),
    ("In scenes that actuate", "MOTOR_COLUMNS"),
    ("With `recording.energy`", "ENERGY_COLUMNS"),
    ("With `recording.dissipation_interval_s`", "LEDGER_COLUMNS"),
    ("In scenes with hooks", "HOOK_COLUMNS"),
    ("In scenes with a phase `compress`", "PLATE_COLUMNS"),
    ("In scenes with grips of rigid bodies", "GRIP_COLUMNS"),
    ("In scenes that take the container away", "RELEASE_COLUMNS"),
    ("In scenes that strain a chain", "STRAIN_COLUMNS"),
    ("In scenes of filaments", "FILAMENT_COLUMNS"),
    ("In scenes of chains of links", "JOINT_COLUMNS"),
)


def cell(text: str) -> str:
    """Return a text as the content of a Markdown cell: one line, with | and < escaped."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def code(text: str) -> str:
    """Return a name as Markdown's inline code; an empty name gives an empty text."""
    return f"`{text}`" if text else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; the caller escapes the cells."""
    return "\n".join(table_lines(head, rows)) + "\n"


def _described(columns: Mapping[str, Any], what: str) -> str:
    rows = [(code(name), cell(one.unit), cell(one.description)) for name, one in columns.items()]
    return table((what, "unit", "meaning"), rows)


def series_columns() -> str:
    """Return tables of the datasets of `series.h5` by scenes that record them; LookupError if one has no group."""
    from dem.record import columns  # noqa: PLC0415

    sets = {title: getattr(columns, name) for title, name in _SETS}
    missing = set(columns.EVERY) - {name for one in sets.values() for name in one}
    if missing:
        raise LookupError(f"docs/made/tables.py: no set has {sorted(missing)}; add it to _SETS")
    return "\n".join(f"### {title}\n\n{_described(found, 'dataset')}" for title, found in sets.items())


def frame_fields() -> str:
    """Return tables of the cell data of a frame, which have one value per link."""
    from dem.record.columns import BODY_FIELDS, FIELDS, MOTOR_FIELDS  # noqa: PLC0415

    sets = {"In every scene": FIELDS, "In scenes that actuate": MOTOR_FIELDS, "In scenes with `particle`": BODY_FIELDS}
    return "\n".join(f"### {title}\n\n{_described(fields, 'field')}" for title, fields in sets.items())


def force_fields() -> str:
    """Return a table of the cell data of a force file, which have one value per contact."""
    from dem.record.columns import FORCE_FIELDS  # noqa: PLC0415

    return _described(FORCE_FIELDS, "field")


def export_fields() -> str:
    """Return a table of the fields of exported bodies."""
    from postprocess.bodies.fields import FIELDS  # noqa: PLC0415

    rows = [(code(field.name), cell(field.unit), field.of, cell(field.meaning)) for field in FIELDS]
    return table(("field", "unit", "per", "meaning"), rows)


def measure_columns() -> str:
    """Return a section per module of measures: its docstring, and a table of its columns."""
    from postprocess.measures.registry import FrameMeasure, registered  # noqa: PLC0415

    parts: dict[str, list[tuple[str, str, str]]] = {}
    for measure in registered():
        module = measure.take.func.__module__ if isinstance(measure.take, partial) else measure.take.__module__
        if isinstance(measure, FrameMeasure):
            evaluated = "last frame of each phase" if measure.costly else "each frame"
            evaluated += f", with `--also {measure.name}`" if measure.on_request else ""
        else:
            evaluated = "phases " + ", ".join(code(name) for name in measure.phases)
        rows = [(code(quantity.header), cell(measure.name), evaluated) for quantity in measure.quantities]
        parts.setdefault(module, []).extend(rows)
    texts = []
    for module, rows in parts.items():
        about = (import_module(module).__doc__ or "").strip()
        head = ("column", "measure", "evaluated for")
        texts.append(f"### {module.rpartition('.')[2]}\n\n{about}\n\n{table(head, rows)}")
    return "\n".join(texts)


def packing_definitions() -> str:
    """Return a table of the definitions of the packing fraction."""
    from postprocess.measures.packing import DEFINITIONS  # noqa: PLC0415

    return table(("name", "definition"), [(code(name), cell(text)) for name, text in DEFINITIONS.items()])


def command_list() -> str:
    """Return a table of all commands, with links to their help."""
    from smarticles.main import build_parser  # noqa: PLC0415

    _, commands = build_parser()
    rows = []
    for name, parser in commands.parsers.items():
        summary = (parser.description or "").partition("\n")[0].rstrip(".")
        rows.append((f"[{code(name)}](#command-{name})", cell(summary)))
    return table(("command", "purpose"), rows)


def command_help() -> str:
    """Return sections with the output of `--help` for `smarticles` and every command."""
    os.environ["COLUMNS"] = _WIDTH
    os.environ["NO_COLOR"] = "1"
    from smarticles.main import build_parser  # noqa: PLC0415

    parser, commands = build_parser()
    texts = [("smarticles", "smarticles", parser.format_help())]
    texts += [(name, f"smarticles {name}", found.format_help()) for name, found in commands.parsers.items()]
    return "\n".join(f"(command-{name})=\n## {title}\n\n```text\n{text.rstrip()}\n```\n" for name, title, text in texts)


def finding(readme: Path) -> tuple[str, str]:
    """Return heading and finding of a README, its first two lines; LookupError if it begins otherwise."""
    lines = [line for line in readme.read_text(encoding="utf-8").splitlines() if line.strip()]
    if not (len(lines) > 1 and lines[0].startswith("# ") and lines[1].startswith("> ")):
        msg = f"{readme}: must begin with a heading, '# …', and the finding in one line with its numbers, '> …'"
        raise LookupError(msg)
    return lines[0].removeprefix("# "), lines[1].removeprefix("> ")


def results_index() -> str:
    """Return a table of all folders of results with their findings."""
    rows = []
    for readme in sorted(RESULTS.glob("*/README.md")):
        _, text = finding(readme)
        rows.append((code(f"results/{readme.parent.name}"), text.replace("|", "\\|")))
    return table(("folder", "finding"), rows)
