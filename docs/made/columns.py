"""Tables of what runs record and what measures say of them: datasets, fields, columns, with their units."""

from __future__ import annotations

from functools import partial
from importlib import import_module

from made.tables import cell, code, table

_SETS = (
    ("In every scene", "COLUMNS"),
    ("In scenes that actuate", "MOTOR_COLUMNS"),
    ("With `recording.energy`", "ENERGY_COLUMNS"),
    ("With `recording.dissipation_interval_s`", "LEDGER_COLUMNS"),
    ("In scenes with hooks", "HOOK_COLUMNS"),
    ("In scenes that take the container away", "RELEASE_COLUMNS"),
    ("In scenes that strain a chain", "STRAIN_COLUMNS"),
)


def series_columns() -> str:
    """Datasets of `series.h5`, set by set.

    Raises:
        LookupError: the sets that are told are not all that there are.
    """
    from dem.record import columns  # noqa: PLC0415  (only where it is asked for)

    told: list[str] = []
    parts = []
    for title, name in _SETS:
        found = getattr(columns, name)
        told += found
        rows = [(code(key), cell(column.unit), cell(column.description)) for key, column in found.items()]
        parts.append(f"### {title}\n\n" + table(("dataset", "unit", "what"), rows))
    if set(told) != set(columns.EVERY):
        msg = f"docs/made/columns.py: tells no set with {sorted(set(columns.EVERY) - set(told))}; add it to _SETS"
        raise LookupError(msg)
    return "\n".join(parts)


def frame_fields() -> str:
    """Cell data of a frame, one value per link."""
    from dem.record.columns import FIELDS, MOTOR_FIELDS  # noqa: PLC0415

    parts = []
    for title, fields in (("In every scene", FIELDS), ("In scenes that actuate", MOTOR_FIELDS)):
        rows = [(code(name), cell(field.unit), cell(field.description)) for name, field in fields.items()]
        parts.append(f"### {title}\n\n" + table(("field", "unit", "what"), rows))
    return "\n".join(parts)


def force_fields() -> str:
    """Cell data of a file of forces, one value per contact."""
    from dem.record.columns import FORCE_FIELDS  # noqa: PLC0415

    rows = [(code(name), cell(field.unit), cell(field.description)) for name, field in FORCE_FIELDS.items()]
    return table(("field", "unit", "what"), rows)


def export_fields() -> str:
    """Fields of exported bodies."""
    from postprocess.bodies.fields import FIELDS  # noqa: PLC0415

    rows = [(code(field.name), cell(field.unit), f"each {field.of}", cell(field.meaning)) for field in FIELDS]
    return table(("field", "unit", "of", "what"), rows)


def measure_columns() -> str:
    """Columns of the measures, one part per module, which says what they are."""
    from postprocess.measures.registry import FrameMeasure, registered  # noqa: PLC0415

    parts: dict[str, list[tuple[str, str, str]]] = {}
    for measure in registered():
        module = measure.take.func.__module__ if isinstance(measure.take, partial) else measure.take.__module__
        if isinstance(measure, FrameMeasure):
            of = "the last frame of each phase" if measure.costly else "each frame"
        else:
            of = "each phase " + ", ".join(code(name) for name in measure.phases)
        rows = [(code(quantity.header), cell(measure.name), of) for quantity in measure.quantities]
        parts.setdefault(module, []).extend(rows)
    texts = []
    for module, rows in parts.items():
        said = (import_module(module).__doc__ or "").strip()
        head = ("column", "measure", "taken of")
        texts.append(f"### {module.rpartition('.')[2]}\n\n{said}\n\n{table(head, rows)}")
    return "\n".join(texts)


def packing_definitions() -> str:
    """The definitions of the packing fraction."""
    from postprocess.measures.packing import DEFINITIONS  # noqa: PLC0415

    return table(("definition", "what it is"), [(code(name), cell(text)) for name, text in DEFINITIONS.items()])
