"""Command `study`: compute and analyse a shipped study."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from dem.display import progress_of
from dem.errors import InputError
from dem.terminal import folded, screen_width
from smarticles.command_line import Commands, add_options, columns
from smarticles.measuring import follows
from smarticles.sweeps import changed_sweep, compute, folder_of, raise_failures
from studies import registry

if TYPE_CHECKING:
    from studies.framework.runs import MeasuredRun
    from studies.framework.study import Study
    from templates.sweep.expand import Point
    from templates.sweep.folder import Entry, Folder
    from templates.sweep.render import Value

LIST = "list"  #: In place of a study's name: print the names of all studies
_ABOUT = "\n\n".join(f"{name}: {study.about}" for name, study in registry.STUDIES.items())


def add(commands: Commands) -> None:
    """Add `study` to the command line."""
    study = commands.add(
        "study",
        run_study,
        summary="compute and analyse a shipped sweep, and compare it with published results; list them",
        text=_ABOUT
        + """

DIR gets the runs, and DIR/results the tables, the figures and a picture of one run. Ctrl-C stops the
study; repeat the command to continue. `smarticles status DIR` prints the progress. --analyse analyses
the finished runs, also while others are being computed. The NAME list prints all studies.""",
        examples="""\
  smarticles study gravish --quick --out gravish-quick
  smarticles study list
  smarticles study gravish --out gravish
  smarticles study gravish --out gravish --jobs 4            use 4 cores
  smarticles study gravish --out gravish-yade --engine yade    compute every run on YADE
  smarticles study sensitivity --out sensitivity
  smarticles study procedures --quick --out procedures-quick
  smarticles study procedures --out procedures --analyse     analyse the finished runs
  smarticles study procedures --out more --earlier results/procedures    reuse these tables
""",
    )
    names = (LIST, *registry.STUDIES)
    study.add_argument("name", choices=names, metavar="NAME", help=f"{LIST}, or {', '.join(registry.STUDIES)}")
    study.add_argument("--quick", action="store_true", help="a small variant that takes minutes")
    study.add_argument(
        "--fidelity", metavar="NAME", help="replace the fidelity of the study: draft, standard or reference"
    )
    add_options(study, "--engine", help="compute all runs on this engine")
    add_options(study, "--analyse")
    study.add_argument(
        "--earlier",
        type=Path,
        metavar="RESULTS",
        help="folder of results of an earlier analysis; runs of equal scenes are taken from its tables",
    )
    add_options(study, "--out", help="directory of the study")
    add_options(study, "--jobs")


def run_study(arguments: argparse.Namespace) -> int:
    """Compute the missing runs of a shipped study and analyse the study; return the exit status."""
    if arguments.name == LIST:
        return _list(arguments)
    if arguments.out is None:
        msg = f"study {arguments.name}: --out DIR is missing; give a directory for its runs, tables and figures"
        raise InputError(msg)
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
        msg = f"--engine {arguments.engine}: study {arguments.name} does not allow it ({error}); leave --engine out"
        raise InputError(msg) from None
    folder = folder_of(sweep, points, arguments.out, arguments.command_line)
    lines = differences(points, expand(load_sweep(shipped.sweep_file())))
    note = f"not the full study: {'; '.join(lines)}" if lines else "the full study as shipped"
    full = shipped.found if lines else ""
    print(note, *([f"the full study found: {full}"] if full else []), sep="\n", flush=True)
    earlier = {} if arguments.earlier is None else _earlier(arguments.earlier, folder, shipped.load())
    if earlier:
        note += f"; {len(earlier)} runs from the tables of an earlier analysis, {arguments.earlier}"
    pictured = shipped.load().pictured
    return compute_and_analyse(
        folder, arguments, shipped.load, note=note, full=full, pictured=pictured, earlier=earlier
    )


def _list(arguments: argparse.Namespace) -> int:
    """Print the names of all studies with what each is about; return the exit status."""
    for name in ("quick", "fidelity", "engine", "analyse", "earlier", "out", "jobs"):
        if getattr(arguments, name):
            raise InputError(f"study {LIST}: takes no --{name}, it prints the names of the studies; leave it out")
    rows = [
        [name, "yes" if study.quick else "no", " ".join(study.about.split())]
        for name, study in registry.STUDIES.items()
    ]
    print(columns(["study", "--quick", "about"], rows))
    return 0


def compute_and_analyse(
    folder: Folder,
    arguments: argparse.Namespace,
    load: Callable[[], Study],
    *,
    note: str,
    full: str = "",
    pictured: Mapping[str, object],
    earlier: Mapping[str, MeasuredRun] = MappingProxyType({}),
) -> int:
    """Compute the missing runs of a sweep, analyse its finished runs, and print the results; return 0.

    With --analyse no run is computed. `load` returns the study; it is called after the runs, since it imports large
    libraries. For the results, `note` says how the runs differ from the full study, `full` what that one found (empty
    if these runs are the full study). The first finished run with the values `pictured` of variables is drawn. Runs of
    an `earlier` analysis, by name, are not computed again.

    InputError if --analyse is given and no run is finished; RunError if a run failed: the finished ones have been
    analysed.
    """
    missing = folder.only([entry for entry in folder.entries if entry.name not in earlier])
    outcomes = [] if arguments.analyse else compute(missing, jobs=arguments.jobs, command=arguments.command_line)
    finished = [entry for entry in folder.entries if folder.is_done(entry)]
    if arguments.analyse and not finished and not earlier:
        raise InputError(f"--analyse: no run of {folder.path} is finished; leave --analyse out to start them")
    if finished or earlier:
        results = folder.path / "results"
        # All runs are passed, since tables list unfinished runs as missing.
        runs = [folder.run(entry) for entry in folder.entries]
        with progress_of("analysing") as progress:
            report = load().analyse(
                runs,
                results,
                note=note,
                full=full,
                command=arguments.command_line,
                earlier=earlier,
                progress=progress,
            )
        figures = [f"figure: {path}" for path in report.files.values() if path.suffix == ".png"]
        origin = f"tables, and the origin of every number: {report.output}"
        lines = folded("\n".join(report.lines), width=screen_width())
        print(columns(report.header, report.rows), "", lines, "", *figures, origin, sep="\n", flush=True)
        _draw(folder, finished, pictured, results / "run.png")
    # Raised last, so that the results of the finished runs are printed before.
    raise_failures(folder, outcomes)
    return 0


def _draw(folder: Folder, finished: Sequence[Entry], values: Mapping[str, object], output: Path) -> None:
    """Draw the first finished run whose variables have these values, into the file `output`."""
    from postprocess.pictures.render import render_run  # noqa: PLC0415  (imports PyVista)

    for entry in finished:
        if all(entry.values.get(name) == value for name, value in values.items()):
            output.parent.mkdir(parents=True, exist_ok=True)
            render_run(folder.run(entry), output=output, overwrite=True)
            print(f"picture of {entry.name}: {output}")
            return


def _earlier(results: Path, folder: Folder, study: Study) -> Mapping[str, MeasuredRun]:
    """Read the measured runs of an earlier analysis from its folder `results`, by name of the run.

    Only runs whose name and scene are those of a run in `folder` are read. InputError if the study cannot be analysed
    from tables, since it needs the files of the runs.
    """
    from studies.framework.runs import Wanted, earlier_runs  # noqa: PLC0415

    if not study.from_tables:
        raise InputError(f"--earlier {results}: study {study.name} needs the files of all runs; leave --earlier out")
    wanted = {
        entry.name: Wanted(scene=folder.scene(entry), scene_sha256=entry.scene_sha256) for entry in folder.entries
    }
    return earlier_runs(results, wanted)


def _fidelity(name: str, file: Path, fidelity: str) -> dict[str, str]:
    from dem.setting.fidelity import FIDELITIES  # noqa: PLC0415
    from templates.sweep.expand import expand  # noqa: PLC0415
    from templates.sweep.sweep_file import load_sweep, with_constants  # noqa: PLC0415

    if fidelity not in FIDELITIES:
        raise InputError(f"--fidelity {fidelity}: is not known; known: {', '.join(FIDELITIES)}")
    sweep, changed = load_sweep(file), {"fidelity": fidelity}
    shipped = sweep.content.constants.get("fidelity")
    if fidelity == (shipped["base"] if isinstance(shipped, Mapping) else shipped):
        return {}  # the study's own fidelity of this name, with its changes to single parameters
    try:
        scenes = [{point.scene_sha256 for point in expand(s)} for s in (sweep, with_constants(sweep, changed))]
    except InputError as error:
        if shipped is not None:
            msg = f"--fidelity {fidelity}: study {name} does not allow it ({error}); leave --fidelity out"
            raise InputError(msg) from None
        scenes = []
    if not scenes or scenes[0] & scenes[1]:
        msg = f"--fidelity {fidelity}: study {name} sets the fidelity of its runs itself; leave --fidelity out"
        raise InputError(msg)
    return changed


def differences(quick: Sequence[Point], full: Sequence[Point]) -> list[str]:
    """Return the differences between a quick variant and the full study as lines of text.

    Returns:
        `9 runs instead of 24`: fewer runs;
        `l_over_w: only 0.4, 0.7 of 0.4, 0.5, 0.7`: fewer values of a variable;
        `shake_s: 1.5 instead of 5.0`: another value in all runs that both have;
        `shake_s: 1.5 instead of 5.0 in 3 of 9 runs`: another value in some of them;
        `draws: 3` or `draws: not there`: a variable that only one of them has.
    """
    lines = [] if len(quick) == len(full) else [f"{len(quick)} runs instead of {len(full)}"]
    full_by_name = {point.name: point for point in full}
    pairs = [(point, full_by_name[point.name]) for point in quick if point.name in full_by_name]
    listed: list[str] = []
    for name in dict.fromkeys([*full[0].values, *quick[0].values]):
        if not (name in full[0].values and name in quick[0].values):
            lines.append(f"{name}: {_distinct(quick, name) or 'not there'}")
            continue
        some, every = _distinct(quick, name), _distinct(full, name)
        changed = [pair for pair in pairs if pair[0].values[name] != pair[1].values[name]]
        if changed:
            new, old = (_distinct([pair[k] for pair in changed], name) for k in (0, 1))
            some = f" in {len(changed)} of {len(quick)} runs" if len(changed) < len(pairs) else ""
            lines.append(f"{name}: {new} instead of {old}{some}")
        elif some != every and not any(follows(name, other, [point.values for point in full]) for other in listed):
            listed.append(name)
            lines.append(f"{name}: only {some} of {every}")
    return lines


def _distinct(points: Sequence[Point], name: str) -> str:
    """Return the distinct values of a variable as text, numbers in ascending order."""
    values: list[Value] = []
    for value in (point.values[name] for point in points if name in point.values):
        if value not in values:  # mappings cannot be in a set
            values.append(value)
    if all(isinstance(value, int | float) for value in values):
        values.sort()
    return ", ".join(value.get("base", str(value)) if isinstance(value, dict) else str(value) for value in values)
