"""Command `calibrate`: infer parameters of a scene from measured data."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING

from dem.display import progress_of
from dem.errors import InputError
from dem.record.names import OF_SWEEP
from dem.terminal import say, warn
from smarticles import sweeps
from smarticles.command_line import Commands, add_options, columns

if TYPE_CHECKING:
    from studies.calibration.emulator import Array
    from studies.calibration.inference import Measured
    from studies.calibration.problem import Problem
    from templates.sweep.folder import Folder
    from templates.sweep.render import Value

_PRICED = 8  # points whose costs stand for those of all points of a wave
_FILE_HELP = """
A calibration file names a scene, its free parameters, and measured data:

  schema_version: 1
  name: staples
  template: scene.yaml.j2           # a scene with {{ variables }}, also {{ seed }}; beside this file
  constants: {fidelity: draft}      # values that all runs share
  free:                             # parameters with priors: uniform, or normal between low and high
    friction: {low: 0.2, high: 1.0}
    friction_wall: {low: 0.2, high: 1.5, mean: 0.6, sd: 0.1}
  data: measured.csv
  budget: 200                       # largest number of runs
  seeds: 1                          # runs of each point and condition
  waves: 2                          # each wave narrows the region of the next one
  discrepancy: 0.05                 # scale of the half-normal prior of the model's relative error

Instead of a template, `scene: scene.yaml` with `keys: {friction: contact.friction_smarticle, …}`, which
names the key of every variable. The data have a row for each measured point:

  l_over_w,count,measure,value,error,predict
  0.4,494,phi second-highest-com [-] @ 1,0.1425,0.003,0
  0.7,270,phi second-highest-com [-] @ 3,0.130,0.003,1

`error` is one standard deviation, with that between repetitions of the experiment. `predict` 1 keeps a
point out of the fit. All other columns are variables of the template, and describe the condition.
A measure is a column of `smarticles measure`, at the end of a phase: `@ 1` is the second, `@ -1` the last.

DIR gets a sweep for each wave, wave1, wave2, …, and DIR/results: posterior, pairs plot, fit, predictions,
sensitivity, and contact.yaml, which scenes can name: `contact: {preset: contact.yaml}`. Ctrl-C stops; repeat
the command to continue. Failed runs are reported and left out; `smarticles resume DIR/wave1` tries again.
With --submit slurm each call submits one wave: repeat the command when its runs are done."""


def add(commands: Commands) -> None:
    """Add `calibrate` to the command line."""
    calibrate = commands.add(
        "calibrate",
        run_calibrate,
        summary="infer parameters such as friction from measured data",
        text=_FILE_HELP + "\n" + sweeps.CLUSTER_HELP,
        examples="""\
  smarticles calibrate staples.yaml --dry-run
  smarticles calibrate staples.yaml --out staples
  smarticles calibrate staples.yaml --out staples --submit slurm --cluster example-large
  smarticles calibrate staples.yaml --out staples --table runs.csv     use runs that were made elsewhere
""",
    )
    calibrate.add_argument("calibration", type=Path, metavar="CALIBRATION.yaml", help="calibration file")
    add_options(calibrate, "--out", help="directory of the calibration")
    add_options(calibrate, "--table", help="runs made elsewhere: a column for each variable and measure; starts no run")
    add_options(calibrate, "--submit", default="local")
    add_options(calibrate, "--dry-run", help="print the runs of each wave and their expected wall time; write nothing")
    add_options(calibrate, "--jobs")
    sweeps.add_cluster_options(calibrate)


def run_calibrate(arguments: argparse.Namespace) -> int:
    """Compute the missing runs of a calibration, and analyse it when all are done; return the exit status."""
    from studies.calibration.inference import calibrate, require_extra  # noqa: PLC0415
    from studies.calibration.measures import check_measures  # noqa: PLC0415
    from studies.calibration.problem import load_problem  # noqa: PLC0415
    from studies.calibration.simulators import TableSimulator, read_runs  # noqa: PLC0415

    problem = load_problem(arguments.calibration)
    for_cluster = sweeps.is_for_cluster(arguments)
    table = None
    if arguments.table is None:
        check_measures(problem)
    else:
        table = TableSimulator(problem, read_runs(arguments.table, problem), str(arguments.table))
    if arguments.dry_run:
        print(_listing(problem) if table is None else table.listing())
        return 0
    if arguments.out is None:
        raise InputError("calibrate: --out DIR is missing; give a directory, or --dry-run to only list the runs")
    require_extra()
    from studies.calibration.report import write  # noqa: PLC0415  (draws: an extra)

    simulator = table or SweepSimulator(problem, arguments, for_cluster=for_cluster)
    result = calibrate(problem, simulator, say=_say, shown=progress_of)
    if result is None:
        print(f"when these runs are done, continue with: {arguments.command_line}")
        return 0
    output = arguments.out / "results"
    with progress_of("writing tables and figures"):
        lines = write(result, output, arguments.command_line)
    say("\n".join(lines))
    print(f"tables and figures: {output}")
    return 0


def _say(text: str) -> None:
    print(text, flush=True)


@dataclass(frozen=True)
class SweepSimulator:
    """Computes each wave (batch of runs) of a calibration as a sweep, on this machine or on a cluster."""

    problem: Problem
    arguments: argparse.Namespace
    for_cluster: bool

    def _path(self, wave: int) -> Path:
        return Path(self.arguments.out) / f"wave{wave}"

    def planned(self, wave: int) -> Array | None:
        """Return the parameters (n, d) of the points of a wave (counted from 1); None if it has no sweep yet.

        The d columns are the free parameters, in the order of the calibration file; InputError if the sweep lacks one.
        """
        import numpy as np  # noqa: PLC0415

        from studies.calibration.problem import POINT  # noqa: PLC0415
        from templates.sweep.folder import open_folder  # noqa: PLC0415

        path = self._path(wave)
        if not (path / OF_SWEEP).exists():
            return None
        try:
            points = {
                entry.values[POINT]: [float(entry.values[name]) for name in self.problem.names]
                for entry in open_folder(path).entries
            }
        except KeyError as error:
            msg = f"{path}: its runs have no variable {error}; give {self.problem.path} a directory of its own"
            raise InputError(msg) from None
        return np.array([points[point] for point in sorted(points)])

    def run(self, wave: int, theta: Array) -> Sequence[tuple[Mapping[str, Value], Measured | None]] | None:
        """Compute or submit the missing runs of a wave; return variables and measures of all its runs.

        The wave is counted from 1; `theta` (n, d) has a row of parameters for each point. The measures of a failed run
        are None. The whole result is None as long as some runs have neither finished nor failed.
        """
        sweep, points = self.problem.sweep(wave, theta)
        folder = sweeps.folder_of(sweep, points, self._path(wave), self.arguments.command_line)
        states = {status.name: status.state for status in folder.status()}
        waiting = folder.only([entry for entry in folder.entries if states[entry.name] not in ("done", "failed")])
        if waiting.entries and not self._complete(waiting):
            return None
        for status in folder.status():
            if status.state != "done":
                warn(f"{status.directory} is left out: {status.cause or status.state}")
        return self._measured(folder)

    def _complete(self, waiting: Folder) -> bool:
        """Compute the waiting runs here, or leave them to others; return whether they were computed here.

        For a cluster, a job is written or submitted. With --submit none and no --cluster, the command that starts the
        runs is printed.
        """
        if self.for_cluster:
            sweeps.enqueue(waiting, self.arguments)
            return False
        if self.arguments.submit == "none":
            print(f"{waiting.path}: {len(waiting.entries)} runs to do; start them: smarticles resume {waiting.path}")
            return False
        sweeps.compute(waiting, jobs=self.arguments.jobs, command=self.arguments.command_line)
        return True

    def _measured(self, folder: Folder) -> list[tuple[Mapping[str, Value], Measured | None]]:
        from dem.record.run import Run  # noqa: PLC0415
        from studies.calibration.simulators import measured  # noqa: PLC0415

        found: list[tuple[Mapping[str, Value], Measured | None]] = []
        with progress_of("measuring") as progress:
            for number, entry in enumerate(folder.entries, start=1):
                condition = entry.values["condition"]
                names = [datum.measure for datum in self.problem.data if datum.condition == condition]
                done = folder.is_done(entry)
                found.append((entry.values, measured(Run(folder.run(entry)), names) if done else None))
                progress("runs measured", number, len(folder.entries))
        return found


def _listing(problem: Problem) -> str:
    """Return a table of the waves: numbers of points and runs, and expected wall time on one core [h]."""
    from studies.calibration.inference import first_points  # noqa: PLC0415

    size, rows, total = problem.points_per_wave, [], 0.0
    # Costs depend on parameters, such as restitution. Points of later waves are not known yet, and count as the first.
    theta = first_points(problem, size)[:_PRICED]
    for wave in range(1, problem.content.waves + 1):
        _, points = problem.sweep(wave, theta)
        count = size * len(points) // len(theta)
        hours = count * fmean([sweeps.expected_wall_s(point.scene) for point in points]) / 3600
        rows.append([wave, size, len(problem.conditions_of(wave)), problem.content.seeds, count, hours])
        total += hours
    header = ["wave", "points", "conditions", "seeds", "runs", "expected h"]
    runs = sum(row[4] for row in rows)
    return (
        f"{columns(header, rows)}\n{runs} runs of a budget of {problem.content.budget}, about {total:.2g} h of one core"
    )
