"""report: one page that tells everything of a run, a sweep or a study."""

from __future__ import annotations

import argparse
from pathlib import Path

from dem.errors import InputError
from smarticles.parsing import Commands, add_overwrite, add_slots


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
    add_slots(report)
    add_overwrite(report)


def write_report(arguments: argparse.Namespace) -> int:
    """`smarticles report`."""
    from postprocess.report.figures import refuse_to_overwrite, whole_file  # noqa: PLC0415

    output: Path = arguments.output or arguments.directory / "report.html"
    if output.suffix != ".html":
        msg = f"--output {output}: a report is HTML; let its name end in .html"
        raise InputError(msg)
    # Before a minute of measuring, not after it.
    refuse_to_overwrite(output, overwrite=arguments.overwrite)
    if arguments.output is not None and not output.parent.is_dir():
        msg = f"--output {output}: the folder {output.parent} does not exist; make it, or choose another one"
        raise InputError(msg)
    _refuse_what_is_no_table(arguments.accuracy)
    from smarticles.reporting.kinds import page_of  # noqa: PLC0415  (pandas, matplotlib, PyVista)
    from smarticles.reporting.page import to_html  # noqa: PLC0415

    text = to_html(page_of(arguments.directory, table=arguments.accuracy, jobs=arguments.jobs))
    with whole_file(output, overwrite=arguments.overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"{output}: {len(text.encode()) / 1e6:.1f} MB; open it in a browser")
    return 0


def _refuse_what_is_no_table(table: Path | None) -> None:
    """A table that was asked for is on the page; of the one that ships the page says why it is not there.

    Raises:
        InputError: it cannot be read.
    """
    if table is None:
        return
    from dem.plan.choice import QUANTITIES, read_table  # noqa: PLC0415

    try:
        read_table(table, of=tuple(QUANTITIES))
    except InputError as error:
        raise InputError(str(error).replace("--table", "--accuracy")) from None
