"""report: one page of everything about a run, a sweep or a study."""

from __future__ import annotations

import argparse
from pathlib import Path

from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from smarticles.command_line import Commands, add_shared


def add(commands: Commands) -> None:
    """Add the command."""
    report = commands.add(
        "report",
        write_report,
        summary="one HTML page of a run, a sweep or a study",
        text="""
Scene, effects and why, settings and their measured accuracy, measures, figures, the final state, which can
be turned, comparison with the paper and with Gravish where a study has one, warnings of the logs, and how to
repeat it. The file holds all that it shows: it can be sent, kept, and opened without a network.""",
        examples="""\
  smarticles report runs/a                                  runs/a/report.html
  smarticles report friction --output friction.html         of a sweep
  smarticles report gravish                                 of a study, with its findings
  smarticles report results/gravish --output gravish.html   of the results of a study alone
""",
    )
    report.add_argument("directory", type=Path, metavar="DIR", help="of a run, a sweep, a study, or a study's results")
    report.add_argument("--output", type=Path, metavar="FILE.html", help="default: DIR/report.html")
    report.add_argument(
        "--accuracy", type=Path, metavar="FILE.csv", help="measured errors of fidelities; default: those that ship"
    )
    add_shared(report, "--jobs", "--overwrite")


def write_report(arguments: argparse.Namespace) -> int:
    """Write the page."""
    from postprocess.report.figures import check_output, whole_file  # noqa: PLC0415

    directory: Path = arguments.directory
    output: Path = arguments.output or directory / "report.html"
    if output.suffix != ".html":
        raise InputError(f"--output {output}: a report is HTML; let its name end in .html")
    # Before a minute of measuring, not after it.
    check_output(output, overwrite=arguments.overwrite)
    if arguments.output is not None and not output.parent.is_dir():
        msg = f"--output {output}: the folder {output.parent} does not exist; make it, or choose another one"
        raise InputError(msg)
    if arguments.accuracy is not None:
        from dem.plan.choice import QUANTITIES, read_table  # noqa: PLC0415

        try:
            read_table(arguments.accuracy, of=tuple(QUANTITIES))
        except InputError as error:
            raise InputError(str(error).replace("--table", "--accuracy")) from None
    text = _page(directory, arguments.accuracy, arguments.jobs)
    with whole_file(output, overwrite=arguments.overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"{output}: {len(text.encode()) / 1e6:.1f} MB; open it in a browser")
    return 0


def _page(directory: Path, accuracy: Path | None, jobs: int | None) -> str:
    """Return the page of a run, a sweep, a study, or the results of a study."""
    from dem.engine.cores import usable_cores  # noqa: PLC0415
    from smarticles.reporting.run import run_page  # noqa: PLC0415  (pandas, matplotlib, PyVista)
    from smarticles.reporting.sweep import PROVENANCE, results_page, sweep_page  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    if (directory / OF_SWEEP).is_file():
        return sweep_page(open_folder(directory), accuracy, jobs=jobs or usable_cores())
    if (directory / MANIFEST).is_file():
        return run_page(directory, accuracy)
    if (directory / PROVENANCE).is_file():
        return results_page(directory)
    msg = f"{directory}: is no run, sweep or study, nor the results of one; give what `smarticles run` or `sweep` made"
    raise InputError(msg)
