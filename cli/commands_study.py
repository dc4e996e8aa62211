"""study: a shipped sweep, run, measured and compared with its reference."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cli.commands_sweep import add_slots, compute, make_folder, refuse_failures
from cli.layout import columns
from cli.parsing import Commands
from dem.errors import InputError

if TYPE_CHECKING:
    from templates.folder import Entry, Folder


@dataclass(frozen=True, kw_only=True)
class _Analysis:
    """What is to be analysed.

    Args:
        runs: run directories, finished or not.
        output: directory for the results.
        note: how the runs differ from the full study.
        command: the command line.
        quick: whether this is the quick variant, whose analysis takes seconds.
    """

    runs: Sequence[Path]
    output: Path
    note: str
    command: str
    quick: bool


@dataclass(frozen=True, kw_only=True)
class _Study:
    """What is done with the runs of a study.

    Args:
        analyse: measures and writes; gives the text for the terminal.
        pictured: values of the run that a picture is drawn of.
    """

    analyse: Callable[[_Analysis], str]
    pictured: Mapping[str, object]


def _analyse_gravish(analysis: _Analysis) -> str:
    from postprocess.gravish import analyse_gravish  # noqa: PLC0415
    from postprocess.packing import DEFINITIONS  # noqa: PLC0415
    from postprocess.study_runs import QUICK_DEFINITIONS  # noqa: PLC0415

    report = analyse_gravish(
        analysis.runs,
        analysis.output,
        note=analysis.note,
        command=analysis.command,
        definitions=QUICK_DEFINITIONS if analysis.quick else tuple(DEFINITIONS),
    )
    header = ["φ", "l/w", "seeds", "here", "± 95 %", "Gravish", "deviation %"]
    rows = [
        [
            row["stage"],
            row["aspect ratio [-]"],
            row["seeds [-]"],
            f"{row['phi [-]']:.4f}",
            f"{row['phi 95 % [-]']:.4f}",
            f"{row['phi Gravish [-]']:.4f}",
            f"{row['deviation [%]']:+.1f}",
        ]
        for row in report.deviations.to_dict("records")
    ]
    told = [f"{v.question} {v.answer.upper()}\n    {v.evidence}" for v in report.verdicts]
    return told_results(columns(header, rows), told, report.files, analysis.output)


def _analyse_sensitivity(analysis: _Analysis, *, study: str) -> str:
    from postprocess.sensitivity import COMPARED, analyse_sensitivity, told_change, told_value  # noqa: PLC0415

    report = analyse_sensitivity(
        analysis.runs, analysis.output, study=study, note=analysis.note, command=analysis.command
    )
    header = ["variant", "seeds"]
    for name in COMPARED:
        header += [name, "change %"]
    rows = []
    for row in report.summary.to_dict("records"):
        cells: list[object] = [row["variant"], row["seeds [-]"]]
        for name, quantity in COMPARED.items():
            cells.append(told_value(row[f"{quantity} [-]"], row[f"{quantity} 95 % [-]"], name))
            mark = " *" if row[f"{name} clear"] else ""
            cells.append(told_change(row[f"{name} change [%]"], row[f"{name} change 95 % [%]"]) + mark)
        rows.append(cells)
    told = [f"Changes are against {report.baseline}; * beyond the error at 95 %."]
    return told_results(columns(header, rows), told, report.files, analysis.output)


def _analyse_procedures(analysis: _Analysis) -> str:
    from postprocess.procedures import analyse_procedures, told_points  # noqa: PLC0415

    report = analyse_procedures(analysis.runs, analysis.output, note=analysis.note, command=analysis.command)
    told = ["Means over seeds ± standard error.", ""]
    told += [f"{found.verdict.upper()}: {found.paper}\n    {found.ours}" for found in report.findings]
    return told_results(columns(*told_points(report.points)), told, report.files, analysis.output)


def told_results(table: str, told: Sequence[str], files: Mapping[str, Path], output: Path) -> str:
    """What an analysis says at the terminal: its table, its sentences, and where the rest is."""
    figures = [f"figure: {path}" for path in files.values() if path.suffix == ".png"]
    return "\n".join([table, "", *told, "", *figures, f"tables, and the origin of every number: {output}"])


_STUDIES = {
    "gravish": _Study(analyse=_analyse_gravish, pictured={"l_over_w": 0.7}),
    "procedures": _Study(analyse=_analyse_procedures, pictured={"procedure": "shape-change", "l_over_w": 0.7}),
    **{
        name: _Study(analyse=partial(_analyse_sensitivity, study=name), pictured={"variant": "draft"})
        for name in ("sensitivity", "sensitivity-section")
    },
}


def add(commands: Commands) -> None:
    """Add the command."""
    study = commands.add(
        "study",
        run_study,
        summary="a shipped sweep: run, measure, compare with its reference",
        text="""
gravish: U-shapes of several aspect ratios l/w, poured into a cylinder and shaken at Γ = 2, 30 Hz,
against the packing fractions that Gravish et al. measured (PRL 108, 208001). --quick takes minutes
and prints how it differs from the full study, which takes hours.

sensitivity: what the packing fraction before and after shaking owes to restitution, friction, damping,
stiffness and sphere diameter, one at a time, at l/w = 0.7. sensitivity-section: the same for pitch and
rows of spheres, up to the true section.

procedures: shape change, external and internal oscillation of smarticles of several l/w, the latter with
several amplitudes θ too, against the findings of Savoie et al. (Soft Matter 2023): packing fraction,
entanglement, energy, height. 87 runs, seed by seed, so that what is finished covers all points; θ that
the hinge cannot reach at a small l/w are left out. --quick takes minutes.

DIR gets the runs, and results/ with tables, figures and a picture of one run. Ctrl-C stops; the
same command again goes on where it stopped. `smarticles status DIR` tells how far it is, and
--analyse shows what the finished runs say, also while the others are being computed.""",
        examples="""\
  smarticles study gravish --quick --out demo
  smarticles study gravish --out gravish
  smarticles study gravish --out gravish --jobs 4            on another machine, or to leave cores free
  smarticles study sensitivity --out sensitivity
  smarticles study procedures --quick --out procedures-quick
  smarticles study procedures --out procedures --analyse     what the finished runs say so far
""",
    )
    study.add_argument("name", choices=tuple(_STUDIES), metavar="NAME", help=", ".join(_STUDIES))
    study.add_argument("--quick", action="store_true", help="the variant that takes minutes; gravish, procedures")
    study.add_argument(
        "--fidelity", metavar="NAME", help="draft, standard or reference instead of what the study ships with"
    )
    study.add_argument("--analyse", action="store_true", help="start no run, analyse those that are finished")
    study.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory of the study")
    add_slots(study)


def run_study(arguments: argparse.Namespace) -> int:
    """`smarticles study`."""
    from templates.study import study_file  # noqa: PLC0415

    study = _STUDIES[arguments.name]
    file = study_file(arguments.name, quick=arguments.quick)
    changed = _changed(arguments.name, file, arguments.fidelity)
    folder = make_folder(file, arguments.out, arguments.command_line, changed)
    note = _note(arguments.name, file, changed)
    print(note, flush=True)

    def analyse(runs: Sequence[Path], output: Path) -> str:
        return study.analyse(
            _Analysis(runs=runs, output=output, note=note, command=arguments.command_line, quick=arguments.quick)
        )

    return compute_and_analyse(folder, arguments, analyse, study.pictured)


def compute_and_analyse(
    folder: Folder,
    arguments: argparse.Namespace,
    analyse: Callable[[Sequence[Path], Path], str],
    pictured: Mapping[str, object],
) -> int:
    """Run what a sweep is missing unless --analyse says not to, then say what the finished runs say.

    Args:
        folder: the sweep's directory.
        arguments: of the command.
        analyse: measures the run directories given, finished or not, and writes to a folder; gives the text for the
            terminal.
        pictured: values of the run that a picture is drawn of.

    Raises:
        InputError: no run is finished and none is to be started.
        RunError: a run failed.
    """
    outcomes = [] if arguments.analyse else compute(folder, arguments)
    finished = [entry for entry in folder.entries if folder.is_done(entry)]
    if arguments.analyse and not finished:
        msg = f"--analyse: no run of {folder.path} is finished; leave --analyse out to start them"
        raise InputError(msg)
    if finished:
        results = folder.path / "results"
        # All runs: those that are not done are listed as missing in every table.
        print(analyse([folder.run(entry) for entry in folder.entries], results))
        sys.stdout.flush()
        _draw(folder, finished, pictured, results / "run.png")
    # Last, so that what is there is shown before what is missing.
    refuse_failures(folder, outcomes)
    return 0


def _changed(name: str, file: Path, fidelity: str | None) -> dict[str, str]:
    """Constants of the study that the command line changes.

    Raises:
        InputError: the study has a fidelity of its own.
    """
    from templates.sweep import load_sweep  # noqa: PLC0415

    if fidelity is None:
        return {}
    if "fidelity" not in load_sweep(file).content.constants:
        msg = f"--fidelity {fidelity}: study {name} compares variants of one fidelity; leave --fidelity out"
        raise InputError(msg)
    return {"fidelity": fidelity}


def _note(name: str, file: Path, changed: Mapping[str, str]) -> str:
    """How what is run differs from the full study as it ships, one line."""
    from templates.expand import expand  # noqa: PLC0415
    from templates.study import differences, study_file  # noqa: PLC0415
    from templates.sweep import load_sweep, with_constants  # noqa: PLC0415

    here = expand(with_constants(load_sweep(file), changed))
    lines = differences(here, expand(load_sweep(study_file(name))))
    return f"not the full study: {'; '.join(lines)}" if lines else "the full study as shipped"


def _draw(folder: Folder, finished: Sequence[Entry], values: Mapping[str, object], output: Path) -> None:
    """Draw the first finished run that has these values."""
    from postprocess.render import render_run  # noqa: PLC0415  (imports PyVista)

    for entry in finished:
        if all(entry.values.get(name) == value for name, value in values.items()):
            output.parent.mkdir(parents=True, exist_ok=True)
            render_run(folder.run(entry), output=output, overwrite=True)
            print(f"picture of {entry.name}: {output}")
            return
