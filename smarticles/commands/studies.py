"""The shipped studies: how the runs of each are analysed, and what is said of them at the terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

from smarticles.layout import columns


def told_results(table: str, told: Sequence[str], files: Mapping[str, Path], output: Path) -> str:
    """What an analysis says at the terminal: its table, its sentences, and where the rest is."""
    figures = [f"figure: {path}" for path in files.values() if path.suffix == ".png"]
    return "\n".join([table, "", *told, "", *figures, f"tables, and the origin of every number: {output}"])


@dataclass(frozen=True, kw_only=True)
class Analysis:
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
class Study:
    """What is done with the runs of a study.

    Args:
        analyse: measures and writes; gives the text for the terminal.
        pictured: values of the run that a picture is drawn of.
        about: what it is, for `smarticles study --help`.
    """

    analyse: Callable[[Analysis], str]
    pictured: Mapping[str, object]
    about: str


def _analyse_gravish(analysis: Analysis) -> str:
    from postprocess.measures.packing import DEFINITIONS  # noqa: PLC0415
    from studies.base.runs import QUICK_DEFINITIONS  # noqa: PLC0415
    from studies.gravish.study import analyse_gravish  # noqa: PLC0415

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


def _analyse_sensitivity(analysis: Analysis, *, study: str) -> str:
    from studies.sensitivity.study import COMPARED, analyse_sensitivity, told_change, told_value  # noqa: PLC0415

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


def _analyse_procedures(analysis: Analysis) -> str:
    from studies.procedures.study import analyse_procedures, told_points  # noqa: PLC0415

    report = analyse_procedures(analysis.runs, analysis.output, note=analysis.note, command=analysis.command)
    told = ["Means over seeds ± standard error.", ""]
    told += [f"{found.verdict.upper()}: {found.paper}\n    {found.ours}" for found in report.findings]
    return told_results(columns(*told_points(report.points)), told, report.files, analysis.output)


def _analyse_reported(analysis: Analysis, *, module: str) -> str:
    """Analyse by the function `analyse` of a module, which gives a `StudyReport`."""
    analyse = import_module(module).analyse
    report = analyse(analysis.runs, analysis.output, note=analysis.note, command=analysis.command)
    told = [*report.told, ""] if report.told else []
    told += [f"{found.verdict.upper()}: {found.paper}\n    {found.ours}" for found in report.findings]
    return told_results(columns(report.header, report.rows), told, report.files, analysis.output)


STUDIES: Mapping[str, Study] = {
    "gravish": Study(
        analyse=_analyse_gravish,
        pictured={"l_over_w": 0.7},
        about="""\
U-shapes of several aspect ratios l/w, poured into a cylinder and shaken at Γ = 2, 30 Hz, against the packing
fractions that Gravish et al. measured (PRL 108, 208001). --quick takes minutes and prints how it differs
from the full study, which takes hours.""",
    ),
    "sensitivity": Study(
        analyse=partial(_analyse_sensitivity, study="sensitivity"),
        pictured={"variant": "draft"},
        about="""\
what the packing fraction before and after shaking owes to restitution, friction, damping, stiffness and
sphere diameter, one at a time, at l/w = 0.7.""",
    ),
    "sensitivity-section": Study(
        analyse=partial(_analyse_sensitivity, study="sensitivity-section"),
        pictured={"variant": "draft"},
        about="""\
the same for pitch and rows of spheres, up to the true section.""",
    ),
    "procedures": Study(
        analyse=_analyse_procedures,
        pictured={"procedure": "shape-change", "l_over_w": 0.7},
        about="""\
shape change, external and internal oscillation of smarticles of several l/w, the latter with several
amplitudes θ too, against the findings of Savoie et al. (Soft Matter 2023): packing fraction, entanglement,
energy, height. 87 runs, seed by seed, so that what is finished covers all points; θ that the hinge cannot
reach at a small l/w are left out. --quick takes minutes.""",
    ),
    "fracture": Study(
        analyse=partial(_analyse_reported, module="studies.fracture.study"),
        pictured={"procedure": "shape-change", "l_over_w": 0.7},
        about="""\
a hook is pulled out of piles that were prepared by each procedure, by internal oscillation of several
amplitudes θ, and of several l/w, against the findings of Savoie et al. (Soft Matter 2023) on tensile loading:
force against time, peak force, work, and how they go with entanglement. 36 runs of the paper's numbers of
smarticles, seed by seed; --quick takes minutes.""",
    ),
    "melting": Study(
        analyse=partial(_analyse_reported, module="studies.melting.study"),
        pictured={"procedure": "shape-change", "lift_m_per_s": 0, "l_over_w": 0.7},
        about="""\
the container's wall is taken away, at once or lifted, after shape change, internal or external oscillation or
none: what holds together, spreads, comes off or falls over within 2 s, against the text of Savoie et al.
48 runs of hours; --quick takes minutes.""",
    ),
    "casting": Study(
        analyse=partial(_analyse_reported, module="studies.casting.study"),
        pictured={"procedure": "internal"},
        about="""\
smarticles of l/w = 0.8 poured into a mould of three tiers, each narrower than the one below, and activated; the
walls go at once: how well each tier is filled before, and what is kept 1 s later. --quick takes minutes.""",
    ),
    "collapse": Study(
        analyse=partial(_analyse_reported, module="studies.collapse.study"),
        pictured={"l_over_w": 0.4, "gamma": 2.5},
        about="""\
free-standing columns of U-shapes on a vibrating floor at Γ = 2 to 4: collapse times, and Δ of
τ = (1/f) exp(Δ/Γ) against l/w, compared with Gravish et al. (PRL 108, 208001). 72 runs, seed by seed;
columns that stand to the end give bounds. --quick takes minutes: lower and narrower columns.""",
    ),
    "chain": Study(
        analyse=partial(_analyse_reported, module="studies.chain.study"),
        pictured={"variant": "baseline", "count": 2, "h_over_H": 0.8},
        about="""\
strain test of a chain of two or six robots between two walls, against the findings of Savoie et al. (Soft Matter
2023): force, yield, width, fracture against confinement; and what friction, servos and strings, which the paper
does not tell, matter. 90 runs, seed by seed. --quick takes minutes.""",
    ),
}
