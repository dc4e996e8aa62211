"""compare: what differs between two runs or two sweeps, in scene, versions, measures and bits."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from smarticles.command_line import Cell, Commands, add_shared, as_json, columns, reject_existing
from smarticles.measuring import PHASE, grouped, has_frames, measured, values_in

if TYPE_CHECKING:
    import pandas as pd

    from dem.record.run import Run
    from templates.sweep.folder import Folder

Differences = dict[str, tuple[Any, Any]]  #: Values of A and B by key; None where one of them has no such key

_NUMBERS = ("A", "B", "B - A", "SE of B - A")


def add(commands: Commands) -> None:
    """Add the command."""
    compare = commands.add(
        "compare",
        compare_two,
        summary="two runs or two sweeps: what differs in scene, versions, measures and bits",
        text="""
Shows which keys of the scene and which versions differ, whether series and frames are the same bit for
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
    add_shared(compare, "--overwrite", "--json")


def compare_two(arguments: argparse.Namespace) -> int:
    """Print or write what differs."""
    import pandas as pd  # noqa: PLC0415

    from postprocess.report.tables import write_table  # noqa: PLC0415

    output: Path | None = arguments.table
    reject_existing("--table", output, overwrite=arguments.overwrite)
    found = compare(arguments.a, arguments.b)
    if output is not None:
        write_table(pd.DataFrame(found["measures"]), output, overwrite=arguments.overwrite)
    if arguments.json:
        print(as_json(found))
        return 0
    print(f"A  {arguments.a}\nB  {arguments.b}\n")
    for what in ("scene", "versions"):
        rows = [[key, *("-" if value is None else str(value) for value in pair)] for key, pair in found[what].items()]
        print(columns([what, "A", "B"], rows) if rows else f"{what}: the same", end="\n\n")
    print("measures: the same" if found["identical"] else _measures(found["measures"]), end="\n\n")
    for name, runs in found["only"].items():
        if runs:
            print(f"only in {name}: {', '.join(runs)}")
    bits = found["bits"]
    if found["kind"] == "run":
        print("identical bits:", *map(_bits, bits.values()))
    else:
        same = sum(one["identical"] for one in bits.values())
        print(f"identical bits: {same} of {len(bits)} runs that both have")
        print(*(f"  {name}: {_bits(one)}\n" for name, one in bits.items() if not one["identical"]), sep="", end="")
    if output is not None:
        print(f"{output}: {len(found['measures'])} rows")
    return 0


def _bits(bits: Mapping[str, Any]) -> str:
    if bits["identical"]:
        return f"yes, {'all of the series' if bits['series'] else 'no series to compare'} and {bits['frames']} frames"
    parts = [] if bits["differs_at"] is None else [f"the series differ from t = {bits['differs_at']:g} s on"]
    parts += [] if bits["same_count"] else ["one has more samples, columns or frames"]
    parts.append(f"{bits['frames']} of {bits['compared']} frames are the same")
    return f"no, {', '.join(parts)}"


def _measures(found: Sequence[Mapping[str, Any]]) -> str:
    """Return the quantities that short tables have, in their order, place by place."""
    from postprocess.measures.registry import shown_quantities  # noqa: PLC0415

    shown = {quantity.header: one for quantity, one in shown_quantities()}
    keys = [key for key in (found or [{}])[0] if key not in ("phase", "quantity", *_NUMBERS)]
    cells = []
    for _, rows in groupby(found, key=lambda row: [row[key] for key in ("phase", *keys)]):
        place = {row["quantity"]: row for row in rows}
        for name, one in shown.items():
            if name in place:
                numbers = [Cell.of(place[name][number], one.form, one.factor) for number in _NUMBERS]
                cells.append([*(place[name][key] for key in keys), one.heading, *numbers])
    if not cells:
        return "no phase of both has been measured"
    return columns([*keys, "measure", "A", "B", "B - A", "± SE"], cells)


def compare(one: Path, other: Path) -> dict[str, Any]:
    """Compare two runs, or two sweeps.

    Returns:
        kind: "run" or "sweep".
        identical: whether everything compared is the same, bit for bit, and nothing was left out.
        scene: `Differences` of the scenes, dots for nesting; of sweeps, of their constants and variables.
        versions: `Differences` of what computed them.
        only: runs that one sweep alone has, by its letter; empty of runs.
        bits: by the runs' names, see `same_bits`; of two runs one entry.
        measures: one row per phase, or group and phase, and quantity: A, B, B - A, and its standard error.

    Raises:
        InputError: one is a run and the other a sweep, or they are neither.
    """
    from dem.record.run import open_run  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    kinds = [_kind(path) for path in (one, other)]
    if kinds[0] != kinds[1]:
        raise InputError(f"{one} is a {kinds[0]} and {other} a {kinds[1]}; give two of a kind")
    if kinds[0] == "sweep":
        found = _sweeps(open_folder(one), open_folder(other))
    else:
        first, second = open_run(one), open_run(other)
        tables = [measured([path]) if has_frames(path) else None for path in (one, other)]
        found = {
            "scene": differences(first.scene, second.scene),
            "versions": differences(_made_by(first), _made_by(second)),
            "only": {},
            "bits": {first.manifest.name: same_bits(first, second)},
            "measures": _beside(*tables, keys=PHASE),
        }
    bits = found["bits"].values()
    identical = bool(bits) and not any(found["only"].values()) and all(one["identical"] for one in bits)
    return {"kind": kinds[0], "identical": identical, **found}


def _kind(path: Path) -> str:
    if (path / OF_SWEEP).is_file():
        return "sweep"
    if (path / MANIFEST).is_file():
        return "run"
    msg = f"{path}: is neither a run directory nor that of a sweep; give what `smarticles run` or `sweep` made"
    raise InputError(msg)


def _made_by(run: Run) -> dict[str, Any]:
    made = run.manifest
    return {"engine": made.engine, **made.versions, "threads": made.threads, "status": run.status.state}


def _sweeps(one: Folder, other: Folder) -> dict[str, Any]:
    from templates.sweep.sweep_file import SEED  # noqa: PLC0415

    first, second = ({entry.name: run for entry, run in zip(f.entries, f.runs(), strict=True)} for f in (one, other))
    both = [name for name in first if name in second]
    begun = [name for name in both if all((runs[name].path / MANIFEST).is_file() for runs in (first, second))]
    varied = [values_in(folder) for folder in (one, other)]
    keys = [*(name for name in varied[0] if name != SEED and name in varied[1]), *PHASE]
    tables = [grouped(measured([folder.path]), keys) for folder in (one, other)]
    return {
        "scene": differences(*map(_listed, varied)),
        "versions": differences(*(_versions(runs.values()) for runs in (first, second))),
        "only": {
            "A": [name for name in first if name not in second],
            "B": [name for name in second if name not in first],
        },
        "bits": {name: same_bits(first[name], second[name]) for name in begun},
        "measures": _beside(*tables, keys=keys),
    }


def _listed(values: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    return {name: some[0] if len(some) == 1 else ", ".join(map(str, some)) for name, some in values.items()}


def _versions(runs: Iterable[Run]) -> dict[str, Any]:
    """Return the versions of all runs of a sweep that have begun."""
    found: dict[str, dict[Any, None]] = {}
    for run in runs:
        for name, value in _made_by(run).items() if (run.path / MANIFEST).is_file() else ():
            found.setdefault(name, {})[value] = None
    return _listed({name: list(values) for name, values in found.items() if name != "status"})


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> Differences:
    """Return the keys whose values differ, nested ones with dots."""
    first, second = _flat(one), _flat(other)
    return {key: (first.get(key), second.get(key)) for key in first | second if first.get(key) != second.get(key)}


def _flat(value: Any, place: str = "") -> dict[str, Any]:
    if isinstance(value, list) and any(isinstance(item, Mapping | list) for item in value):
        value = {str(index): item for index, item in enumerate(value)}
    if not isinstance(value, Mapping):
        return {place: value}
    return {
        key: found
        for name, item in value.items()
        for key, found in _flat(item, f"{place}.{name}" if place else name).items()
    }


def same_bits(one: Run, other: Run) -> dict[str, Any]:
    """Compare two runs bit for bit: the columns of the series, not its file, which names the scene; files of frames.

    Returns:
        series: whether all columns that both have are the same; None where one has no series.
        differs_at: simulated time of the first sample that differs [s]; None where none does.
        frames, compared: frames that are the same, and that both have.
        same_count: whether both have the same numbers of frames, samples and columns.
        identical: whether nothing differs.
    """
    import numpy as np  # noqa: PLC0415

    frames = [run.frames.paths if has_frames(run.path) else () for run in (one, other)]
    same = sum(a.read_bytes() == b.read_bytes() for a, b in zip(*frames, strict=False))
    series: bool | None = None
    differs_at = None
    alike = len(frames[0]) == len(frames[1]) and one.has_series == other.has_series
    if one.has_series and other.has_series:
        a, b = one.series, other.series
        alike = alike and len(a) == len(b) and a.data.keys() == b.data.keys()
        length = min(len(a), len(b))
        differing = np.zeros(length, dtype=bool)
        for name in a.data.keys() & b.data.keys():
            pair = [np.ascontiguousarray(run[name][:length]) for run in (a, b)]
            if pair[0].dtype != pair[1].dtype or pair[0].shape != pair[1].shape:
                differing[:] = True
            else:
                unlike = np.not_equal(*(values.view(np.uint8).reshape(length, -1) for values in pair))
                differing |= unlike.any(axis=1)
        series = not bool(differing.any())
        differs_at = None if series else float(a.time[differing.argmax()])
    compared = min(map(len, frames))
    identical = series is not False and same == compared and alike
    found = {"series": series, "differs_at": differs_at, "frames": same, "compared": compared}
    return {**found, "same_count": alike, "identical": identical}


def _beside(one: pd.DataFrame | None, other: pd.DataFrame | None, *, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Return quantities of two tables beside each other, one row per place and quantity."""
    from postprocess.statistics.points import marked  # noqa: PLC0415

    def records(table: pd.DataFrame | None) -> dict[str, dict[Any, Any]]:
        rows = [] if table is None else table.to_dict("records")
        return {json.dumps([row[key] for key in keys], default=str): row for row in rows}

    rows = []
    twins = records(other)
    for place, row in records(one).items():
        twin = twins.get(place, {})
        for name, value in row.items():
            quantity = name.endswith("]") and " SE [" not in name and name not in keys and name in twin
            if not quantity or not isinstance(value, int | float):
                continue
            a, b = float(value), float(twin[name])
            error = math.hypot(*(float(side.get(marked(name, "SE"), math.nan)) for side in (row, twin)))
            if not (math.isnan(a) and math.isnan(b)):
                numbers = zip(_NUMBERS, (a, b, b - a, error), strict=True)
                rows.append({**{key: row[key] for key in keys}, "quantity": name, **dict(numbers)})
    return rows
