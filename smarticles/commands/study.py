"""study: a shipped sweep, run, measured and compared with its reference."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from dem.errors import InputError
from smarticles.command_line import Commands, add_engine, add_shared, columns
from smarticles.measuring import follows
from smarticles.sweeps import changed_sweep, compute, folder_of, raise_failures
from studies import registry

if TYPE_CHECKING:
    from studies.framework.runs import MeasuredRun
    from studies.framework.study import Study
    from templates.sweep.expand import Point
    from templates.sweep.folder import Entry, Folder

_ABOUT = "\n\n".join(f"{name}: {study.about}" for name, study in registry.STUDIES.items())


def add(commands: Commands) -> None:
    """Add the command."""
    study = commands.add(
        "study",
        run_study,
        summary="a shipped sweep: run, measure, compare with its reference",
        text=_ABOUT
        + """

DIR gets the runs, and results/ with tables, figures and a picture of one run. Ctrl-C stops; the
same command again goes on where it stopped. `smarticles status DIR` shows how far it is, and
--analyse shows what the finished runs say, also while the others are being computed.""",
        examples="""\
  smarticles study gravish --quick --out demo
  smarticles study gravish --out gravish
  smarticles study gravish --out gravish --jobs 4            on another machine, or to leave cores free
  smarticles study gravish --out gravish-yade --engine yade    every run on one engine
  smarticles study sensitivity --out sensitivity
  smarticles study procedures --quick --out procedures-quick
  smarticles study procedures --out procedures --analyse     what the finished runs say so far
  smarticles study procedures --out more --earlier results/procedures    only the runs that are not in these tables
""",
    )
    study.add_argument("name", choices=tuple(registry.STUDIES), metavar="NAME", help=", ".join(registry.STUDIES))
    study.add_argument("--quick", action="store_true", help="the variant that takes minutes")
    study.add_argument(
        "--fidelity", metavar="NAME", help="draft, standard or reference instead of what the study ships with"
    )
    add_engine(study, "all runs on this engine, instead of those that the study ships with")
    study.add_argument("--analyse", action="store_true", help="start no run, analyse those that are finished")
    study.add_argument(
        "--earlier",
        type=Path,
        metavar="RESULTS",
        help="results of an earlier analysis: runs of the same scenes in its tables are not computed again",
    )
    study.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory of the study")
    add_shared(study, "--jobs")


def run_study(arguments: argparse.Namespace) -> int:
    """Run a shipped study, then analyse it."""
    from templates.sweep.expand import expand  # noqa: PLC0415
    from templates.sweep.sweep_file import load_sweep  # noqa: PLC0415

    shipped = registry.shipped(arguments.name)
    file = shipped.sweep_file(quick=arguments.quick)
    constants = {} if arguments.fidelity is None else _fidelity(arguments.name, file, arguments.fidelity)
    try:
        sweep = changed_sweep(file, constants, arguments.engine)
        points = expand(sweep)
    except InputError as error:
        if arguments.engine is None:
            raise
        msg = f"--engine {arguments.engine}: study {arguments.name} cannot be run on it ({error}); leave --engine out"
        raise InputError(msg) from None
    folder = folder_of(sweep, points, arguments.out, arguments.command_line)
    lines = differences(points, expand(load_sweep(shipped.sweep_file())))
    note = f"not the full study: {'; '.join(lines)}" if lines else "the full study as shipped"
    print(note, flush=True)
    earlier = {} if arguments.earlier is None else _earlier(arguments.earlier, folder, shipped.load())
    if earlier:
        note += f"; {len(earlier)} runs from the tables of an earlier analysis, {arguments.earlier}"
    pictured = shipped.load().pictured
    return compute_and_analyse(folder, arguments, shipped.load, note=note, pictured=pictured, earlier=earlier)


def compute_and_analyse(
    folder: Folder,
    arguments: argparse.Namespace,
    load: Callable[[], Study],
    *,
    note: str,
    pictured: Mapping[str, object],
    earlier: Mapping[str, MeasuredRun] = MappingProxyType({}),
) -> int:
    """Run what a sweep is missing unless --analyse forbids it, then analyse the finished runs.

    Args:
        load: gives the study that analyses the runs, once there are any: its libraries are large.
        note: how the runs differ from the full study.
        pictured: values of the run that a picture is drawn of.
        earlier: runs that were measured before; they are not computed again.

    Raises:
        InputError: no run is finished and none is to be started.
        RunError: a run failed.
    """
    needed = folder.only([entry for entry in folder.entries if entry.name not in earlier])
    outcomes = [] if arguments.analyse else compute(needed, jobs=arguments.jobs, command=arguments.command_line)
    finished = [entry for entry in folder.entries if folder.is_done(entry)]
    if arguments.analyse and not finished and not earlier:
        raise InputError(f"--analyse: no run of {folder.path} is finished; leave --analyse out to start them")
    if finished or earlier:
        results = folder.path / "results"
        # All runs: those that are not done are listed as missing in every table.
        runs = [folder.run(entry) for entry in folder.entries]
        report = load().analyse(runs, results, note=note, command=arguments.command_line, earlier=earlier)
        figures = [f"figure: {path}" for path in report.files.values() if path.suffix == ".png"]
        origin = f"tables, and the origin of every number: {report.output}"
        print(columns(report.header, report.rows), "", *report.lines, "", *figures, origin, sep="\n", flush=True)
        _draw(folder, finished, pictured, results / "run.png")
    # Last, so that what is there is shown before what is missing.
    raise_failures(folder, outcomes)
    return 0


def _draw(folder: Folder, finished: Sequence[Entry], values: Mapping[str, object], output: Path) -> None:
    """Draw the first finished run that has these values."""
    from postprocess.pictures.render import render_run  # noqa: PLC0415  (imports PyVista)

    for entry in finished:
        if all(entry.values.get(name) == value for name, value in values.items()):
            output.parent.mkdir(parents=True, exist_ok=True)
            render_run(folder.run(entry), output=output, overwrite=True)
            print(f"picture of {entry.name}: {output}")
            return


def _earlier(results: Path, folder: Folder, study: Study) -> Mapping[str, MeasuredRun]:
    """Return the runs of a sweep that an earlier analysis measured."""
    from studies.framework.runs import Wanted, earlier_runs  # noqa: PLC0415

    if not study.from_tables:
        raise InputError(f"--earlier {results}: study {study.name} draws from the runs themselves; leave --earlier out")
    wanted = {
        entry.name: Wanted(scene=folder.scene(entry), scene_sha256=entry.scene_sha256) for entry in folder.entries
    }
    return earlier_runs(results, wanted)


def _fidelity(name: str, file: Path, fidelity: str) -> dict[str, str]:
    """Return the constant of a study that --fidelity changes."""
    from dem.setting.fidelity import FIDELITIES  # noqa: PLC0415
    from templates.sweep.expand import expand  # noqa: PLC0415
    from templates.sweep.sweep_file import load_sweep, with_constants  # noqa: PLC0415

    if fidelity not in FIDELITIES:
        raise InputError(f"--fidelity {fidelity}: is not known; known: {', '.join(FIDELITIES)}")
    sweep, changed = load_sweep(file), {"fidelity": fidelity}
    shipped = sweep.content.constants.get("fidelity")
    if shipped == fidelity:
        return changed
    try:
        scenes = [{point.scene_sha256 for point in expand(s)} for s in (sweep, with_constants(sweep, changed))]
    except InputError as error:
        if shipped is not None:
            msg = f"--fidelity {fidelity}: study {name} cannot be run at it ({error}); leave --fidelity out"
            raise InputError(msg) from None
        scenes = []
    if not scenes or scenes[0] & scenes[1]:
        msg = f"--fidelity {fidelity}: study {name} sets the fidelity of its runs itself; leave --fidelity out"
        raise InputError(msg)
    return changed


def differences(quick: Sequence[Point], full: Sequence[Point]) -> list[str]:
    """Return how a quick variant differs from the full study, found from the points themselves.

    Returns:
        Lines such as `9 runs instead of 24`, `l_over_w: only 0.4, 0.7 of 0.4, 0.5, 0.7` (what is
        left out), `shake_s: 1.5 instead of 5.0` (what differs in the runs that both have), and `draws: 3` or
        `draws: not there` of a variable that only one of them has.
    """
    lines = [] if len(quick) == len(full) else [f"{len(quick)} runs instead of {len(full)}"]
    twins = {point.name: point for point in full}
    both = [(point, twins[point.name]) for point in quick if point.name in twins]
    listed: list[str] = []
    for name in dict.fromkeys([*full[0].values, *quick[0].values]):
        if not (name in full[0].values and name in quick[0].values):
            lines.append(f"{name}: {_distinct(quick, name) or 'not there'}")
            continue
        some, every = _distinct(quick, name), _distinct(full, name)
        changed = [pair for pair in both if pair[0].values[name] != pair[1].values[name]]
        if changed:
            here, there = (_distinct([pair[k] for pair in changed], name) for k in (0, 1))
            lines.append(f"{name}: {here} instead of {there}")
        elif some != every and not any(follows(name, other, [point.values for point in full]) for other in listed):
            listed.append(name)
            lines.append(f"{name}: only {some} of {every}")
    return lines


def _distinct(points: Sequence[Point], name: str) -> str:
    values = list(dict.fromkeys(point.values[name] for point in points if name in point.values))
    if all(isinstance(value, int | float) for value in values):
        values.sort()
    return ", ".join(map(str, values))
