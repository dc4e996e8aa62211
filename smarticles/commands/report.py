"""Command `report`: write one HTML page about a run, a sweep or a study."""

import argparse
from pathlib import Path

from dem.display import Steps, progress_of
from dem.errors import InputError
from dem.record.names import MANIFEST, OF_SWEEP
from smarticles.command_line import Commands, add_options, reject_existing


def add(commands: Commands) -> None:
    """Add `report` to the command line."""
    report = commands.add(
        "report",
        write_report,
        summary="write one HTML page about a run, a sweep or a study",
        text="""
The page has the scene, the effects with the reasons for each, the fidelity and its measured accuracy,
measures, figures, views of the final state from all sides, the comparison of a study with published
results, warnings from the logs, and the commands that repeat the work. The file contains all pictures
and needs no network.""",
        examples="""\
  smarticles report runs/a                                  runs/a/report.html
  smarticles report friction --output friction.html         a sweep, with means of its last phase of rest first
  smarticles report friction --phase shake --overwrite      a sweep, with means of its shaken phase first
  smarticles report gravish                                 a study, with its findings
  smarticles report results/gravish --output gravish.html   the results of a study, without its runs
""",
    )
    add_options(report, "directory", help="directory of a run, a sweep, a study, or the results of a study")
    add_options(report, "--output", metavar="FILE.html", help="default: DIR/report.html")
    phase_help = "type of the phase of a sweep whose means come first and are drawn; default: the last phase of rest"
    report.add_argument("--phase", metavar="NAME|last", help=phase_help)
    report.add_argument(
        "--accuracy", type=Path, metavar="FILE.csv", help="table of measured errors; default: the table that ships"
    )
    add_options(report, "--jobs", "--overwrite")


def write_report(arguments: argparse.Namespace) -> int:
    """Write the HTML page and print its name and size; return the exit status."""
    from postprocess.report.tables import whole_file  # noqa: PLC0415

    directory: Path = arguments.directory
    output: Path = arguments.output or directory / "report.html"
    if output.suffix != ".html":
        raise InputError(f"--output {output}: a report is HTML; use a name that ends in .html")
    # Checked before the measures are computed, which can take a minute.
    reject_existing("--output", output, overwrite=arguments.overwrite)
    if arguments.output is not None and not output.parent.is_dir():
        msg = f"--output {output}: the folder {output.parent} does not exist; make it, or choose another one"
        raise InputError(msg)
    if arguments.accuracy is not None:
        from dem.plan.choice import QUANTITIES, read_table  # noqa: PLC0415

        try:
            read_table(arguments.accuracy, of=tuple(QUANTITIES))
        except InputError as error:
            raise InputError(str(error).replace("--table", "--accuracy")) from None
    with progress_of(f"report of {directory}") as progress:
        text = _page(directory, arguments.accuracy, arguments.jobs, arguments.phase, progress)
    with whole_file(output, overwrite=arguments.overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"{output}: {len(text.encode()) / 1e6:.1f} MB; open it in a browser")
    return 0


def _page(directory: Path, accuracy: Path | None, jobs: int | None, phase: str | None, progress: Steps) -> str:
    from smarticles.measuring import usual_jobs  # noqa: PLC0415
    from smarticles.reporting.run import run_page  # noqa: PLC0415  (pandas, matplotlib, PyVista)
    from smarticles.reporting.sweep import PROVENANCE, results_page, sweep_page  # noqa: PLC0415
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    if (directory / OF_SWEEP).is_file():
        return sweep_page(
            open_folder(directory), accuracy, jobs=jobs or usual_jobs([directory]), phase=phase, progress=progress
        )
    if phase is not None:
        raise InputError(f"--phase {phase}: {directory} is no sweep; leave it out, the page of a run has all phases")
    if (directory / MANIFEST).is_file():
        return run_page(directory, accuracy)
    if (directory / PROVENANCE).is_file():
        return results_page(directory)
    msg = (
        f"{directory}: is no run, sweep or study, nor the results of a study; give a directory that `smarticles` wrote"
    )
    raise InputError(msg)
