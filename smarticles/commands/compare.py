"""compare: what differs between two runs or two sweeps, in scene, versions, measures and bits."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP, SERIES
from smarticles.command_line import Cell, Commands, add_json, add_overwrite, as_json, columns, reject_existing
from smarticles.measuring import PHASE, grouped, has_frames, measured, values_in

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from dem.record.run import Run
    from templates.sweep.folder import Folder

Differences = dict[str, tuple[Any, Any]]
"""Values of A and B by key; None where one of them has no such key."""

A, B, DIFFERENCE, ERROR = "A", "B", "B - A", "SE of B - A"
"""Columns of `Comparison.measures`."""


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
    add_overwrite(compare)
    add_json(compare)


@dataclass(frozen=True, kw_only=True)
class Bits:
    """How far two runs are the same, bit for bit.

    Attributes:
        series: whether all columns of the series that both have are; None where one has no series.
        differs_at: simulated time of the first sample that differs [s]; None where none does.
        frames: frames that are the same.
        compared: frames that both have.
        same_count: whether both have the same frames, the same samples and the same columns.
    """

    series: bool | None
    differs_at: float | None
    frames: int
    compared: int
    same_count: bool

    @property
    def identical(self) -> bool:
        """Whether nothing differs."""
        return self.series is not False and self.frames == self.compared and self.same_count

    def __str__(self) -> str:
        if self.identical:
            return f"yes, {'all of the series' if self.series else 'no series to compare'} and {self.frames} frames"
        parts = [] if self.differs_at is None else [f"the series differ from t = {self.differs_at:g} s on"]
        parts += [] if self.same_count else ["one has more samples, columns or frames"]
        return f"no, {', '.join([*parts, f'{self.frames} of {self.compared} frames are the same'])}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Two runs or two sweeps.

    Attributes:
        kind: "run" or "sweep".
        scene: keys of the scene that differ, dots for nesting; of sweeps, of their constants and variables.
        versions: likewise.
        only: runs that one sweep alone has, by its letter; empty of runs.
        bits: by the runs' names; of two runs one entry.
        measures: one row per phase, or group and phase, and quantity: A, B, B - A, and its standard error where both
            have one.
    """

    kind: str
    scene: Differences
    versions: Differences
    only: Mapping[str, Sequence[str]]
    bits: Mapping[str, Bits]
    measures: pd.DataFrame

    @property
    def identical(self) -> bool:
        """Whether everything compared is the same, bit for bit, and nothing was left out."""
        return bool(self.bits) and not any(self.only.values()) and all(bits.identical for bits in self.bits.values())


def compare_two(arguments: argparse.Namespace) -> int:
    """Print or write what differs."""
    from postprocess.report.tables import write_table  # noqa: PLC0415

    output: Path | None = arguments.table
    reject_existing("--table", output, overwrite=arguments.overwrite)
    found = compare(arguments.a, arguments.b)
    if output is not None:
        write_table(found.measures, output, overwrite=arguments.overwrite)
    if arguments.json:
        plain = {**vars(found), "identical": found.identical, "measures": found.measures.to_dict("records")}
        plain["bits"] = {name: {**asdict(bits), "identical": bits.identical} for name, bits in found.bits.items()}
        print(as_json(plain))
        return 0
    print(f"A  {arguments.a}\nB  {arguments.b}\n")
    for what, differing in (("scene", found.scene), ("versions", found.versions)):
        rows = [[key, *("-" if value is None else str(value) for value in pair)] for key, pair in differing.items()]
        print(columns([what, A, B], rows) if rows else f"{what}: the same", end="\n\n")
    print(_measures(found), end="\n\n")
    for name, runs in found.only.items():
        if runs:
            print(f"only in {name}: {', '.join(runs)}")
    if found.kind == "run":
        print("identical bits:", *found.bits.values())
    else:
        different = {name: bits for name, bits in found.bits.items() if not bits.identical}
        both = len(found.bits)
        print(f"identical bits: {both - len(different)} of {both} runs that both have")
        for name, bits in different.items():
            print(f"  {name}: {bits}")
    if output is not None:
        print(f"{output}: {len(found.measures)} rows")
    return 0


def _measures(found: Comparison) -> str:
    """Return the quantities that short tables have, in their order, place by place."""
    from postprocess.measures.registry import shown_quantities  # noqa: PLC0415

    if found.identical:
        return "measures: the same"
    shown = {quantity.header: one for quantity, one in shown_quantities()}
    keys = list(found.measures.columns[: list(found.measures.columns).index("quantity")])
    rows = []
    for _, place in found.measures.groupby(keys, sort=False, dropna=False):
        by_quantity = place.set_index("quantity")
        for header, one in shown.items():
            if header in by_quantity.index:
                row = by_quantity.loc[header]
                numbers = [Cell.of(row[name], one.form, one.factor) for name in (A, B, DIFFERENCE, ERROR)]
                rows.append([*(row[key] for key in keys if key != "phase"), one.heading, *numbers])
    if not rows:
        return "no phase of both has been measured"
    return columns([*(key for key in keys if key != "phase"), "measure", A, B, DIFFERENCE, "± SE"], rows)


def compare(one: Path, other: Path) -> Comparison:
    """Compare two runs, or two sweeps.

    Raises:
        InputError: one is a run and the other a sweep, or they are neither.
    """
    from dem.record.run import open_run  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    kinds = [_kind(path) for path in (one, other)]
    if kinds[0] != kinds[1]:
        msg = f"{one} is a {kinds[0]} and {other} a {kinds[1]}; give two of a kind"
        raise InputError(msg)
    if kinds[0] == "sweep":
        return _sweeps(open_folder(one), open_folder(other))
    first, second = open_run(one), open_run(other)
    return Comparison(
        kind="run",
        scene=differences(first.scene, second.scene),
        versions=differences(_made_by(first), _made_by(second)),
        only={},
        bits={first.manifest.name: same_bits(first, second)},
        measures=_beside(
            *(measured([run.path]) if has_frames(run.path) else None for run in (first, second)), keys=PHASE
        ),
    )


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


def _sweeps(one: Folder, other: Folder) -> Comparison:
    from templates.sweep.sweep_file import SEED  # noqa: PLC0415

    first, second = ({entry.name: run for entry, run in zip(f.entries, f.runs(), strict=True)} for f in (one, other))
    both = [name for name in first if name in second]
    begun = [name for name in both if all((runs[name].path / MANIFEST).is_file() for runs in (first, second))]
    varied = [values_in(folder) for folder in (one, other)]
    keys = [*(name for name in varied[0] if name != SEED and name in varied[1]), *PHASE]
    return Comparison(
        kind="sweep",
        scene=differences(*map(_listed, varied)),
        versions=differences(*(_versions(runs.values()) for runs in (first, second))),
        only={A: [name for name in first if name not in second], B: [name for name in second if name not in first]},
        bits={name: same_bits(first[name], second[name]) for name in begun},
        measures=_beside(*(grouped(measured([folder.path]), keys) for folder in (one, other)), keys=keys),
    )


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


def same_bits(one: Run, other: Run) -> Bits:
    """Return how far two runs hold the same numbers, bit for bit.

    Of the series its columns are compared, not its file, which names the scene; of frames the files.
    """
    import numpy as np  # noqa: PLC0415

    frames = [run.frames.paths if has_frames(run.path) else () for run in (one, other)]
    same = sum(a.read_bytes() == b.read_bytes() for a, b in zip(*frames, strict=False))
    series: bool | None = None
    differs_at = None
    recorded = [(run.path / SERIES).is_file() for run in (one, other)]
    alike = len(frames[0]) == len(frames[1]) and recorded[0] == recorded[1]
    if all(recorded):
        a, b = one.series, other.series
        alike = alike and len(a) == len(b) and a.data.keys() == b.data.keys()
        length = min(len(a), len(b))
        differing = np.zeros(length, dtype=bool)
        for name in a.data.keys() & b.data.keys():
            differing |= _differ(a[name][:length], b[name][:length])
        series = not bool(differing.any())
        differs_at = None if series else float(a.time[differing.argmax()])
    return Bits(series=series, differs_at=differs_at, frames=same, compared=min(map(len, frames)), same_count=alike)


def _differ(one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.bool_]:
    """Return (n,) whether samples differ in a bit, of two arrays of n samples."""
    import numpy as np  # noqa: PLC0415

    if one.dtype != other.dtype or one.shape != other.shape:
        return np.ones(len(one), dtype=bool)
    bits = [np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1) for array in (one, other)]
    unlike: NDArray[np.bool_] = (bits[0] != bits[1]).any(axis=1)
    return unlike


def _beside(one: pd.DataFrame | None, other: pd.DataFrame | None, *, keys: Sequence[str]) -> pd.DataFrame:
    """Return quantities of two tables beside each other, one row per place and quantity."""
    import pandas as pd  # noqa: PLC0415

    from postprocess.statistics.points import marked  # noqa: PLC0415

    rows = []
    twins = {} if other is None else {_place(row, keys): row for row in other.to_dict("records")}
    for row in [] if one is None else one.to_dict("records"):
        twin = twins.get(_place(row, keys), {})
        for name, value in row.items():
            quantity = name.endswith("]") and " SE [" not in name and name not in keys and name in twin
            if not quantity or not isinstance(value, int | float):
                continue
            a, b = float(value), float(twin[name])
            error = math.hypot(*(float(side.get(marked(name, "SE"), math.nan)) for side in (row, twin)))
            if not (math.isnan(a) and math.isnan(b)):
                place = {key: row[key] for key in keys}
                rows.append({**place, "quantity": name, A: a, B: b, DIFFERENCE: b - a, ERROR: error})
    return pd.DataFrame(rows, columns=[*keys, "quantity", A, B, DIFFERENCE, ERROR])


def _place(row: Mapping[Any, Any], keys: Sequence[str]) -> str:
    return json.dumps([row[key] for key in keys], default=str)
