"""compare: two runs, or two sweeps, beside each other."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from smarticles.layout import Cell, columns
from smarticles.parsing import Commands, add_json, add_overwrite

if TYPE_CHECKING:
    from smarticles.comparing import Bits, Comparison, Differences


def add(commands: Commands) -> None:
    """Add the command."""
    compare = commands.add(
        "compare",
        compare_two,
        summary="two runs or two sweeps: what differs in scene, versions, measures and bits",
        text="""
Tells which keys of the scene and which versions differ, whether series and frames are the same bit for
bit, and sets the measures of each phase beside each other. Of sweeps runs of one name are compared
bit by bit, and measures as means over the runs of each group of variables; SE is that of the
difference, from those of A and B.""",
        examples="""\
  smarticles compare runs/a runs/b
  smarticles compare friction friction-links --table differences.csv
  smarticles compare runs/a runs/b --json
""",
    )
    compare.add_argument("a", type=Path, metavar="A", help="a run or a sweep")
    compare.add_argument("b", type=Path, metavar="B", help="another one of the same kind")
    compare.add_argument("--table", type=Path, metavar="FILE.csv", help="write all measures as CSV")
    add_overwrite(compare)
    add_json(compare)


def compare_two(arguments: argparse.Namespace) -> int:
    """`smarticles compare`."""
    from postprocess.report.tables import write_table  # noqa: PLC0415
    from smarticles.comparing import compare  # noqa: PLC0415

    output: Path | None = arguments.table
    if output is not None and output.exists() and not arguments.overwrite:
        msg = f"--table {output}: exists; choose another name or give --overwrite"
        raise InputError(msg)
    found = compare(arguments.a, arguments.b)
    if output is not None:
        write_table(found.measures, output, overwrite=arguments.overwrite)
    if arguments.json:
        print(json.dumps(_plain(found), indent=2, ensure_ascii=False, default=str))
        return 0
    print(f"A  {arguments.a}\nB  {arguments.b}\n")
    print("\n".join([*_differing("scene", found.scene), *_differing("versions", found.versions)]))
    print(f"{_measures(found)}\n")
    for line in _bits(found):
        print(line)
    if output is not None:
        print(f"{output}: {len(found.measures)} rows")
    return 0


def _differing(what: str, found: Differences) -> list[str]:
    if not found:
        return [f"{what}: the same", ""]
    table = columns([what, "A", "B"], [[key, _word(a), _word(b)] for key, (a, b) in found.items()])
    return [table, ""]


def _word(value: Any) -> str:
    return "-" if value is None else str(value)


def _measures(found: Comparison) -> str:
    """The quantities that short tables have."""
    from postprocess.measures.registry import shown_quantities  # noqa: PLC0415
    from smarticles.comparing import DIFFERENCE, ERROR, A, B  # noqa: PLC0415

    shown = {quantity.header: one for quantity, one in shown_quantities()}
    keys = [
        name for name in found.measures.columns[: list(found.measures.columns).index("quantity")] if name != "phase"
    ]
    if found.identical:
        return "measures: the same"
    rows = []
    order = {name: place for place, name in enumerate(shown)}
    places = {tuple(row[key] for key in ("phase", *keys)): None for row in found.measures.to_dict("records")}
    for row in sorted(
        (row for row in found.measures.to_dict("records") if row["quantity"] in shown),
        key=lambda row: (list(places).index(tuple(row[key] for key in ("phase", *keys))), order[row["quantity"]]),
    ):
        one = shown[row["quantity"]]
        numbers = [_number(row[name], one.form, one.factor) for name in (A, B, DIFFERENCE, ERROR)]
        rows.append([*(row[key] for key in keys), one.heading, *numbers])
    if not rows:
        return "no phase of both has been measured"
    return columns([*keys, "measure", A, B, DIFFERENCE, "± SE"], rows)


def _number(value: float, form: str, factor: float) -> Cell:
    return Cell(f"{factor * value:{form}}" if math.isfinite(value) else "-")


def _bits(found: Comparison) -> list[str]:
    lines = [f"only in {name}: {', '.join(runs)}" for name, runs in found.only.items() if runs]
    if found.kind == "run":
        (bits,) = found.bits.values()
        return [*lines, f"identical bits: {_told(bits)}"]
    same = [name for name, bits in found.bits.items() if bits.identical]
    lines.append(f"identical bits: {len(same)} of {len(found.bits)} runs that both have")
    return lines + [f"  {name}: {_told(bits)}" for name, bits in found.bits.items() if not bits.identical]


def _told(bits: Bits) -> str:
    if bits.identical:
        return f"yes, {'all of the series' if bits.series else 'no series to compare'} and {bits.frames} frames"
    parts = []
    if bits.differs_at is not None:
        parts.append(f"the series differ from t = {bits.differs_at:g} s on")
    if not bits.same_count:
        parts.append("one has more samples, columns or frames")
    return f"no, {', '.join([*parts, f'{bits.frames} of {bits.compared} frames are the same'])}"


def _plain(found: Comparison) -> dict[str, Any]:
    rows = [
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in found.measures.to_dict("records")
    ]
    return {
        "kind": found.kind,
        "identical": found.identical,
        "scene": {key: list(pair) for key, pair in found.scene.items()},
        "versions": {key: list(pair) for key, pair in found.versions.items()},
        "only": {key: list(runs) for key, runs in found.only.items()},
        "bits": {name: {**bits.__dict__, "identical": bits.identical} for name, bits in found.bits.items()},
        "measures": rows,
    }
