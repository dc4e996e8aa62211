"""The study `compaction`: how φ goes on when piles are shaken ten times as long as Gravish's, and by which law.

What is fitted is in `studies.friction.laws`; a run's history is that of the study `friction`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import told_number
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.questions import Question, QuestionStudy, above_zero, questions_lines
from studies.base.study import Analysis, Tables
from studies.framework.provenance import GRAVISH, SHAKE_TIME, Reference
from studies.framework.runs import Collected, MeasuredRun, runs_table
from studies.friction import compaction_figures
from studies.friction.laws import FIRST, INTERVALS, LAWS, LOGARITHMIC, STRETCHED, fit, spread_out
from studies.friction.measure import FRICTION, friction_run, history_of, refuse_repeats, told_piles, while_shaken

TIMES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
"""When φ is told [s]; each a mean over the last fifth of that time."""

EARLY = 0.25
"""Share of the time that a law is fitted to, to see whether it tells the rest."""

LAW, RESIDUAL, MISSED = "law", "residual [-]", "missed at the end [-]"
BEGIN, END, TAU, POWER = "phi_b [-]", "phi_inf [-]", "tau [s]", "beta or B [-]"


class Compaction(QuestionStudy):
    """Runs that were poured and shaken for long, at few coefficients of friction."""

    name = "compaction"
    text_name = "compaction.md"

    def measure(self, run: RunManifest) -> MeasuredRun:
        """φ before, while and after it is shaken, as in the study `friction`."""
        return friction_run(run)

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one l/w, a point and seed twice."""
        refuse_repeats(found)

    def tabulate(self, found: Collected) -> Tables:
        """Runs, φ in the course of time, and what each law makes of each run."""
        runs = runs_table(found).sort_values([ASPECT, FRICTION, SEED], ignore_index=True, kind="stable")
        return {"runs": runs, "times": over_time(found.runs), "laws": fitted(found.runs)}

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """Whether φ still grows, which law it follows, and what Gravish's 20 s see of it."""
        return answers(tables["times"], tables["laws"])

    def reference_of(self, tables: Tables) -> Reference:
        """Gravish's packing fractions."""
        return GRAVISH

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, how φ is taken, and how errors come about."""
        laws = "; ".join(f"{name}: {law.formula}" for name, law in LAWS.items())
        return (
            self.about_points(analysis),
            f"Laws are fitted to each run, means over {INTERVALS} intervals equally long on a logarithmic axis from "
            f"{FIRST:g} s on. {laws}.",
            "Error bars: 95 % confidence of the mean over seeds, Student's t.",
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, φ in the course of time, and laws."""
        header, rows = self.table(analysis)
        return [
            "# Piles that are shaken for long",
            "",
            *questions_lines(analysis.judged),
            "",
            "## φ in the course of time",
            "",
            "Means over the last fifth of each time, over seeds ± 95 %.",
            "",
            *table_lines(header, rows),
            "",
            "## Laws",
            "",
            f"Means over seeds ± 95 %. Missed: the law fitted to the first {100 * EARLY:g} % of the time, less what φ "
            "is in the last tenth of it.",
            "",
            *table_lines(
                ["friction", "law", "φ_b", "φ_∞", "τ [s]", "β or B", "residual", "missed"],
                [_told_law(key, group) for key, group in analysis.tables["laws"].groupby([FRICTION, LAW], sort=True)],
            ),
        ]

    def about_points(self, analysis: Analysis[Question]) -> str:
        """Seeds, and what φ is."""
        runs = analysis.tables["runs"]
        return f"{told_piles(runs, [FRICTION], 'point')}; φ by the median height that the series records."

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """φ against time with both laws, and what these leave."""
        return compaction_figures.draw(output, runs=analysis.found.runs, footer=footer)

    def table(self, analysis: Analysis[Question]) -> tuple[list[str], list[list[str]]]:
        """φ at each time."""
        header = ["friction", "seeds", *(f"φ {time:g} s" for time in TIMES)]
        rows = []
        for friction, group in analysis.tables["times"].groupby(FRICTION, sort=True):
            means = [mean_over_seeds(group[at(time)].tolist()) for time in TIMES]
            told = [told_number(mean.value, ".4f", mean.half_width) for mean in means]
            rows.append([f"{friction:g}", str(len(group)), *told])
        return header, rows


def at(time: float) -> str:
    """Column of φ after some time of shaking [s]."""
    return f"phi {time:g} s [-]"


def over_time(runs: Sequence[MeasuredRun]) -> pd.DataFrame:
    """One row per run: φ at `TIMES`; NaN where it was not shaken for so long."""
    rows = []
    for run in runs:
        history = history_of(run)
        row: dict[str, object] = {FRICTION: run.row[FRICTION], SEED: run.row[SEED]}
        for time in TIMES:
            late = (history.times > 0.8 * time) & (history.times <= time * (1 + 1e-9))
            known = time <= history.active * (1 + 1e-9) and late.any()
            row[at(time)] = float(history.values[late].mean()) if known else float("nan")
        rows.append(row)
    return pd.DataFrame(rows).sort_values([FRICTION, SEED], ignore_index=True)


def fitted(runs: Sequence[MeasuredRun]) -> pd.DataFrame:
    """One row per run and law: its parameters, what it leaves, and by how much its beginning misses its end."""
    rows = []
    for run in runs:
        times, values = while_shaken(run)
        first, last = times <= EARLY * times[-1], times > 0.9 * times[-1]
        spread, early = spread_out(times, values), spread_out(times[first], values[first])
        for law in LAWS:
            found = fit(law, *spread)
            missed = float(np.mean(fit(law, *early).at(times[last]))) - float(np.mean(values[last]))
            rows.append(
                {
                    FRICTION: run.row[FRICTION],
                    SEED: run.row[SEED],
                    LAW: law,
                    BEGIN: found.begin,
                    END: found.end,
                    TAU: found.tau,
                    POWER: found.power,
                    RESIDUAL: found.residual,
                    MISSED: missed,
                }
            )
    return pd.DataFrame(rows).sort_values([FRICTION, SEED, LAW], ignore_index=True)


def answers(times: pd.DataFrame, laws: pd.DataFrame) -> tuple[Question, ...]:
    """The study's questions, answered over all runs.

    Args:
        times: See `over_time`.
        laws: See `fitted`.
    """
    grown = 100 * (times[at(TIMES[-1])] / times[at(TIMES[-2])] - 1)
    seen = 100 * (times[at(SHAKE_TIME)] / times[at(TIMES[-1])] - 1)
    wide = laws.pivot_table(index=[FRICTION, SEED], columns=LAW, values=[RESIDUAL, MISSED])
    residual = np.log(wide[RESIDUAL][STRETCHED] / wide[RESIDUAL][LOGARITHMIC])
    missed = wide[MISSED].abs()
    return (
        _question(f"Does phi still grow between {TIMES[-2]:g} and {TIMES[-1]:g} s?", grown, "by {} %"),
        _question(f"Is phi after Gravish's {SHAKE_TIME:g} s below that after {TIMES[-1]:g} s?", -seen, "below by {} %"),
        _question(
            "Does a stretched exponential leave less than an inverse logarithm?",
            -100 * residual,
            "ln of the ratio of what they leave {} %",
        ),
        _question(
            f"Does it, fitted to the first {100 * EARLY:g} % of the time, tell the end better?",
            1e3 * (missed[LOGARITHMIC] - missed[STRETCHED]),
            "nearer by {}e-3",
        ),
    )


def _question(question: str, values: pd.Series, told: str) -> Question:
    """Whether a quantity of each run is clearly above 0 in the mean."""
    known = values.dropna().tolist()
    mean = mean_over_seeds(known)
    number = told.format(told_number(mean.value, "+.2f", mean.half_width))
    evidence = f"{number} over {len(known)} runs"
    return Question(question=question, answer=above_zero(mean.value, mean.half_width), evidence=evidence)


def _told_law(key: tuple[float, str], group: pd.DataFrame) -> list[str]:
    friction, law = key
    forms = {BEGIN: ".4f", END: ".4f", TAU: ".3g", POWER: ".3g", RESIDUAL: ".5f", MISSED: "+.4f"}
    means = {name: mean_over_seeds(group[name].tolist()) for name in forms}
    told = [told_number(mean.value, forms[name], mean.half_width) for name, mean in means.items()]
    return [f"{friction:g}", law, *told]
