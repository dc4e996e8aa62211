"""Runs that end with `remove-container`, after a pour, one activity or none, and a rest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dem.errors import InputError
from dem.record.document import Phase
from dem.record.frame import Frame
from dem.record.frames import FrameSequence
from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.figures import Analysis
from studies.framework.procedures import EXTERNAL, INTERNAL, PROCEDURE, PROCEDURES, SHAPE, STATIC
from studies.framework.runs import run_columns

ORDER = (STATIC, EXTERNAL, INTERNAL, SHAPE)  #: Procedures in the order of tables and pictures

_REMOVAL = "remove-container"


def removal(run: Run) -> Phase:
    """Return the phase that removes the wall; InputError unless it is the last phase and follows a rest."""
    last = run.phases[-1]
    if last.type != _REMOVAL or len(run.phases) < 3 or not run.phases[-2].at_rest:
        types = ", ".join(phase.type for phase in run.phases)
        raise InputError(f"{run.path}: does not end with a rest and {_REMOVAL}: its phases are {types}; leave it out")
    return last


def removal_frames(run: Run) -> tuple[Frame, FrameSequence]:
    """Return the last frame with the wall and all frames of the removal; InputError if either is missing."""
    phase, frames = removal(run), run.frames
    rest, after = frames.in_phase(phase.index - 1), frames.in_phase(phase.index)
    if not rest or not after:
        raise InputError(f"{run.path}: no frame of the rest before {_REMOVAL} or of that phase; run it again")
    return rest[len(rest) - 1], after


def named_columns(run: Run) -> dict[str, object]:
    """Return procedure, aspect ratio, seed, count and fidelity of a run, by column.

    InputError if the run has several activities, or an activity of an unknown type.
    """
    active = [phase.type for phase in run.phases if not phase.at_rest and phase.type != _REMOVAL]
    if len(active) > 1 or not set(active) <= set(PROCEDURES):
        raise InputError(
            f"{run.path}: not one activity ({', '.join(PROCEDURES)}) or none: it has {', '.join(active)}; leave it out"
        )
    return {PROCEDURE: PROCEDURES[active[0]] if active else STATIC, **run_columns(run)}


@dataclass(frozen=True, kw_only=True)
class Pictures:
    """Pictures of the first seed of each procedure: with the wall, 0.1 s after its removal, and later."""

    labels: Mapping[str, str]  #: Label of each procedure
    after: float | None = None  #: Time of the last picture since the removal began [s]; None: the end of the run
    select: Sequence[str] = ()  #: Columns that must be 0 in the runs that are drawn
    name: str = "pictures"  #: Name of the file without suffix

    def draw(self, path: Path, analysis: Analysis) -> list[Path]:
        """Draw the pictures and return the path of the file; none if no run directory exists."""
        from postprocess.pictures import strip  # noqa: PLC0415  (imports PyVista)

        runs, rows = analysis.table("runs"), []
        if self.select:
            runs = runs[(runs[list(self.select)] == 0).all(axis=1)]
        runs = runs.assign(apart=(runs[ASPECT] - 0.7).abs()).sort_values(["apart", SEED])
        for procedure, label in self.labels.items():
            names = [name for name in runs.loc[runs[PROCEDURE] == procedure, "run"] if name in analysis.runs]
            if not names:
                continue
            run = analysis.runs[names[0]]
            start, end = removal(run).start_s, run.status.time_s
            if start is not None and end is not None:
                last = end if self.after is None else start + self.after
                rows.append(
                    strip.Row(directory=run.path, label=label, times=(removal_frames(run)[0].time, start + 0.1, last))
                )
        if not rows:
            return []
        columns = ("with the wall", "0.1 s after", "at the end" if self.after is None else f"{self.after:g} s after")
        note = "Each smarticle keeps its colour in all pictures of a row; first seed."
        output = path.with_suffix(".png")
        return [strip.draw_strip(rows, output, columns=columns, footer=[note, *analysis.footer])]
