"""Command `compare`: compare two runs or two sweeps, A and B, down to the bits of series and frames."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.display import progress_of
from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from smarticles.command_line import Cell, Commands, add_options, as_json, columns, reject_existing
from smarticles.measuring import PHASE, grouped, has_frames, measured, values_in

if TYPE_CHECKING:
    import pandas as pd

    from dem.record.run import Run
    from templates.sweep.folder import Folder

Differences = dict[str, tuple[Any, Any]]  #: Values of A and B by key; None stands for a missing key

_NUMBERS = ("A", "B", "B - A", "SE of B - A")


def add(commands: Commands) -> None:
    """Add `compare` to the command line."""
    compare = commands.add(
        "compare",
        compare_two,
        summary="compare two runs or two sweeps: scene, versions, measures and bits",
        text="""
Prints the keys of the scene and the versions that differ (of a resumed run, those of each version and
machine that computed a part of it), the measures of each phase, and whether series
and frames agree bit by bit. Two sweeps are compared run by run: bits for runs with equal names, and
means of measures for runs with equal variables. SE is the standard error of B - A.""",
        examples="""\
  smarticles compare runs/a runs/b
  smarticles compare friction friction-links --table differences.csv
  smarticles compare runs/a runs/b --json
""",
    )
    compare.add_argument("a", type=Path, metavar="A", help="directory of a run or a sweep")
    compare.add_argument("b", type=Path, metavar="B", help="second directory of this kind")
    add_options(compare, "--table", help="write all measures as CSV")
    add_options(compare, "--overwrite", "--json")


def compare_two(arguments: argparse.Namespace) -> int:
    """Print the differences, or write them to files; return the exit status."""
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
        print(columns([what, "A", "B"], rows) if rows else f"{what}: no difference", end="\n\n")
    print("measures: no difference" if found["identical"] else _measures(found["measures"]), end="\n\n")
    for name, runs in found["only"].items():
        if runs:
            print(f"only in {name}: {', '.join(runs)}")
    bits = found["bits"]
    if found["kind"] == "run":
        print("identical bits:", *map(_bits, bits.values()))
    else:
        equal = sum(run["identical"] for run in bits.values())
        print(f"identical bits: {equal} of {len(bits)} runs that both sweeps have")
        print(*(f"  {name}: {_bits(run)}\n" for name, run in bits.items() if not run["identical"]), sep="", end="")
    if output is not None:
        print(f"{output}: {len(found['measures'])} rows")
    return 0


def _bits(bits: Mapping[str, Any]) -> str:
    if bits["identical"]:
        return f"yes, {'all of the series' if bits['series'] else 'no series to compare'} and {bits['frames']} frames"
    parts = [] if bits["differs_at"] is None else [f"the series differ from t = {bits['differs_at']:g} s on"]
    parts += [] if bits["same_count"] else ["one run has more samples, columns or frames"]
    parts.append(f"{bits['frames']} of {bits['compared']} frames are equal")
    return f"no, {', '.join(parts)}"


def _measures(found: Sequence[Mapping[str, Any]]) -> str:
    """Format the rows `measures` of a comparison as a table of the main quantities, phase by phase."""
    from postprocess.measures.registry import shown_quantities  # noqa: PLC0415

    formats = {quantity.header: shown for quantity, shown in shown_quantities()}
    keys = [key for key in (found or [{}])[0] if key not in ("phase", "quantity", *_NUMBERS)]
    cells = []
    for _, rows in groupby(found, key=lambda row: [row[key] for key in ("phase", *keys)]):
        by_quantity = {row["quantity"]: row for row in rows}
        for name, shown in formats.items():
            if name in by_quantity:
                row = by_quantity[name]
                numbers = [Cell.of(row[number], shown.form, shown.factor) for number in _NUMBERS]
                cells.append([*(row[key] for key in keys), shown.heading, *numbers])
    if not cells:
        return "measures: no phase has frames in both, at equal values of the variables that both have"
    return columns([*keys, "measure", "A", "B", "B - A", "± SE"], cells)


def compare(one: Path, other: Path) -> dict[str, Any]:
    """Compare two run directories A and B, or two directories of sweeps.

    Returns:
        kind: "run" or "sweep".
        identical: whether series and frames agree bit by bit in all runs that both have begun; False if there are none,
            or if one sweep has begun a run that the other has not.
        scene: values in A and in B of each key of the scene, or of each variable and constant of the sweeps, that
            differs; see `differences`.
        versions: the same for engine, package versions, machine and number of threads, of all that started and
            resumed a run; for runs also for their status.
        only: for sweeps, names of the runs that A alone (key "A") and B alone (key "B") has begun; empty for runs.
        bits: result of `compare_bits` by the name of the run; one entry for two runs.
        measures: one row per phase and quantity with the values in A and B, B - A, and the standard error of B - A; for
            sweeps, one row per phase, quantity and combination of variables.

    Raises:
        InputError: A is a run and B a sweep or vice versa, or a directory is neither.
    """
    from dem.record.run import open_run  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    kinds = [_kind(path) for path in (one, other)]
    if kinds[0] != kinds[1]:
        raise InputError(f"{one} is a {kinds[0]} and {other} a {kinds[1]}; give two runs or two sweeps")
    if kinds[0] == "sweep":
        found = _compare_sweeps(open_folder(one), open_folder(other))
    else:
        first, second = open_run(one), open_run(other)
        with progress_of("measuring") as progress:
            tables = [measured([path], progress=progress) if has_frames(path) else None for path in (one, other)]
        found = {
            "scene": differences(first.scene, second.scene),
            "versions": differences(_made_by(first), _made_by(second)),
            "only": {},
            "bits": {first.manifest.name: compare_bits(first, second)},
            "measures": _pair_up(*tables, keys=PHASE),
        }
    bits = found["bits"].values()
    identical = bool(bits) and not any(found["only"].values()) and all(run["identical"] for run in bits)
    return {"kind": kinds[0], "identical": identical, **found}


def _kind(path: Path) -> str:
    if (path / OF_SWEEP).is_file():
        return "sweep"
    if (path / MANIFEST).is_file():
        return "run"
    msg = f"{path}: is neither a run nor a sweep; give a directory that `smarticles run` or `sweep` wrote"
    raise InputError(msg)


def _made_by(run: Run) -> dict[str, Any]:
    manifest = run.manifest
    return {"engine": manifest.engine, **manifest.made_by, **manifest.made_on, "status": run.status.state}


def _compare_sweeps(one: Folder, other: Folder) -> dict[str, Any]:
    """Return the entries scene, versions, only, bits and measures of `compare`'s result for two sweeps."""
    from templates.sweep.sweep_file import SEED  # noqa: PLC0415

    first, second = ({entry.name: run for entry, run in zip(f.entries, f.runs(), strict=True)} for f in (one, other))
    begun = [[name for name, run in runs.items() if (run.path / MANIFEST).is_file()] for runs in (first, second)]
    both = [name for name in begun[0] if name in begun[1]]
    varied = [values_in(folder) for folder in (one, other)]
    shared = [name for name in varied[0] if name != SEED and name in varied[1]]
    # A constant with one value in A and another in B is what is compared, and makes no groups.
    differing = [
        name for name in shared if varied[0][name] != varied[1][name] and max(len(v[name]) for v in varied) == 1
    ]
    keys = [*(name for name in shared if name not in differing), *PHASE]
    with progress_of("measuring") as progress:
        tables = [grouped(measured([folder.path], progress=progress), keys) for folder in (one, other)]
    return {
        "scene": differences(*map(_listed, varied)),
        "versions": differences(*(_versions(runs.values()) for runs in (first, second))),
        "only": {
            "A": [name for name in begun[0] if name not in both],
            "B": [name for name in begun[1] if name not in both],
        },
        "bits": {name: compare_bits(first[name], second[name]) for name in both},
        "measures": _pair_up(*tables, keys=keys),
    }


def _listed(values: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    """Return one value for each name: its only value, or a text with all its values, separated by commas."""
    return {name: some[0] if len(some) == 1 else ", ".join(map(str, some)) for name, some in values.items()}


def _versions(runs: Iterable[Run]) -> dict[str, Any]:
    """Return engine, package versions and number of threads of the started runs, by name.

    If runs differ in one of them, it is a text with all values, separated by commas.
    """
    found: dict[str, dict[Any, None]] = {}
    for run in runs:
        for name, value in _made_by(run).items() if (run.path / MANIFEST).is_file() else ():
            found.setdefault(name, {})[value] = None
    return _listed({name: list(values) for name, values in found.items() if name != "status"})


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> Differences:
    """Return the values of A and B, as a pair, for each key whose values differ.

    Keys of nested mappings are joined by dots, such as `contact.restitution`. None stands for a key that is missing.
    """
    from dem.scene.reading import flattened  # noqa: PLC0415

    first, second = flattened(one), flattened(other)
    return {key: (first.get(key), second.get(key)) for key in first | second if first.get(key) != second.get(key)}


def compare_bits(one: Run, other: Run) -> dict[str, Any]:
    """Compare columns of the series and files of the frames of two runs bit by bit.

    Returns:
        series: whether all common columns are equal; None if a run has no series.
        differs_at: simulated time of the first different sample [s]; None if all samples are equal.
        frames: number of equal frames; the files of A and B may have different formats.
        compared: number of frames at equal times; runs of older versions lack those at the ends of phases.
        same_count: whether the runs have frames at the same times, and equal numbers of samples and columns.
        identical: whether nothing differs.
    """
    import numpy as np  # noqa: PLC0415

    first, second = map(_by_time, (one, other))
    common = first.keys() & second.keys()
    same, compared = sum(_equal_frames(first[time], second[time]) for time in common), len(common)
    series: bool | None = None
    differs_at = None
    alike = first.keys() == second.keys() and one.has_series == other.has_series
    if one.has_series and other.has_series:
        a, b = one.series, other.series
        alike = alike and len(a.time) == len(b.time) and a.data.keys() == b.data.keys()
        length = min(len(a.time), len(b.time))
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
    identical = series is not False and same == compared and alike
    found = {"series": series, "differs_at": differs_at, "frames": same, "compared": compared}
    return {**found, "same_count": alike, "identical": identical}


def _by_time(run: Run) -> dict[str, tuple[Path, int]]:
    """Return file and number of each frame of a run by its time, as `frames.pvd` writes it."""
    if not has_frames(run.path):
        return {}
    frames = run.frames
    return {f"{frames.times[k]:.9g}": (frames.paths[k], frames.numbers[k]) for k in range(len(frames))}


def _equal_frames(one: tuple[Path, int], other: tuple[Path, int]) -> bool:
    """Return whether two frames, given by file and number in the file, are equal bit by bit.

    An array `radius_m` that only one of the frames has is ignored.
    """
    from dem.record.frame import read_mesh  # noqa: PLC0415

    if {one[0].suffix, other[0].suffix} == {".vtu"}:
        return one[0].read_bytes() == other[0].read_bytes()
    contents = []
    for path, number in (one, other):
        mesh = read_mesh(path, number=number)
        arrays = {"points": mesh.points, "lines": mesh.cells[0].data, **{k: v[0] for k, v in mesh.cell_data.items()}}
        contents.append({name: (values.dtype, values.shape, values.tobytes()) for name, values in arrays.items()})
    lacked = {"radius_m"} - (contents[0].keys() & contents[1].keys())
    one_content, other_content = ({name: each[name] for name in each.keys() - lacked} for each in contents)
    return one_content == other_content


def _pair_up(one: pd.DataFrame | None, other: pd.DataFrame | None, *, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Pair the rows of tables A and B that have equal values in the columns `keys`.

    Returns a row for each pair and quantity: A, B, B - A, and the standard error of B - A.
    """
    from postprocess.statistics.points import marked  # noqa: PLC0415

    def records(table: pd.DataFrame | None) -> dict[str, dict[Any, Any]]:
        rows = [] if table is None else table.to_dict("records")
        return {json.dumps([row[key] for key in keys], default=str): row for row in rows}

    rows = []
    second = records(other)
    for place, row in records(one).items():
        twin = second.get(place, {})
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
