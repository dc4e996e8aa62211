"""The study `contacts`: friction between smarticles, friction at the container, restitution: which packs a pile?

A full factorial of two values of each; what is made of its runs is in `studies.friction.contact_effects`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.points import marked, told_number
from studies.base.questions import Question, QuestionStudy, questions_lines
from studies.base.study import Analysis, Tables
from studies.framework.plots import draw_combinations
from studies.framework.provenance import GRAVISH, Reference, told_reference
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, runs_table
from studies.framework.shaken import WHEN
from studies.friction.contact_effects import (
    CALLED,
    DEVIATION,
    EFFECT,
    EVERYWHERE,
    FACTOR,
    FACTORS,
    QUANTITIES,
    QUANTITY,
    RESTITUTION,
    RISEN,
    SHARE,
    WALL,
    answers,
    effects,
    named,
    points,
    risen,
)
from studies.friction.measure import FRICTION, WINDOW, contact_of, shaken_run, told_piles


class Contacts(QuestionStudy):
    """Runs that were poured and shaken, by every combination of the factors."""

    name = "contacts"
    text_name = "contacts.md"

    def measure(self, run: RunManifest) -> MeasuredRun:
        """φ before, in the course of and after shaking, and by how much the lowest smarticles rose."""
        contact = contact_of(run, self.name)
        known = {
            FRICTION: contact.number("friction_smarticle"),
            WALL: contact.number("friction_wall"),
            RESTITUTION: contact.number("restitution"),
            RISEN: risen(run),
        }
        return shaken_run(run, known)

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one l/w, a combination and seed twice."""
        found.refuse_mixed_counts()
        found.refuse_repeats("combination", lambda run: " ".join(f"{run.row[name]}" for name in (*FACTORS, ASPECT)))

    def tabulate(self, found: Collected) -> Tables:
        """Runs, means of every combination, and what each factor does."""
        runs = runs_table(found).sort_values([*FACTORS, ASPECT, SEED], ignore_index=True, kind="stable")
        return {"runs": runs, "points": points(runs), "effects": effects(runs)}

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """What lowers φ, which friction does it, and whether a combination packs as Gravish's smarticles did."""
        return answers(tables["runs"], tables["points"])

    def reference_of(self, tables: Tables) -> Reference:
        """Gravish's packing fractions."""
        return GRAVISH

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, how φ is taken, what an effect is."""
        return (
            self.about_points(analysis),
            f"φ {WHEN}. Lowest tenth: mean height of the centres of mass of the lowest tenth of all smarticles above "
            f"the floor, over {WINDOW:g} s.",
            "Effect of a factor: mean of paired differences over seeds, other factors averaged; "
            + ", ".join(f"{CALLED[name]} {low:g} to {high:g}" for name, (low, high) in FACTORS.items())
            + ". Error bars: 95 % confidence of the mean over seeds, Student's t.",
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, effects, and every combination."""
        header, rows = self.table(analysis)
        return [
            "# Friction between smarticles, friction at the container, restitution",
            "",
            *questions_lines(analysis.judged),
            "",
            "## What each factor does",
            "",
            *table_lines(header, rows),
            "",
            "## Combinations",
            "",
            *table_lines(*_told_points(analysis.tables["points"])),
        ]

    def about_points(self, analysis: Analysis[Question]) -> str:
        """Seeds, and what φ is."""
        runs = analysis.tables["runs"]
        return f"{told_piles(runs, [*FACTORS], 'combination')}; φ by {DEFINITION}."

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """How far every combination is from Gravish, and by how much the lowest smarticles rose."""
        table = analysis.tables["points"]
        return draw_combinations(
            output / "contacts",
            points=table,
            factors=FACTORS,
            shown={DEVIATION: r"$\phi_\mathrm{f}$ less Gravish's [%]", RISEN: "rise of the lowest tenth [w]"},
            named=named,
            told=[told_reference(sorted(table[ASPECT].unique()), ("phi_f",))],
            footer=footer,
        )

    def table(self, analysis: Analysis[Question]) -> tuple[list[str], list[list[str]]]:
        """The effects."""
        found = analysis.tables["effects"]
        places = sorted(set(found[ASPECT]) - {EVERYWHERE}, key=float)
        rows = []
        for (quantity, factor), group in found.groupby([QUANTITY, FACTOR], sort=False):
            form = next(form for called, form in QUANTITIES.values() if called == quantity)
            told = {
                row[ASPECT]: told_number(row[EFFECT], f"+{form}", row[marked(EFFECT, "95 %")])
                for _, row in group.iterrows()
            }
            # A factor that was not varied at an aspect ratio has no effect there.
            cells = [told.get(place, "–") for place in (*places, EVERYWHERE)]
            rows.append([str(quantity), str(factor), *cells, told_number(group[SHARE].iloc[-1], "+.1f")])
        header = [QUANTITY, FACTOR, *(f"l/w {place}" for place in places), EVERYWHERE, "of the mean [%]"]
        return header, rows


def _told_points(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    header = ["combination", "l/w", "seeds", *(called for called, _ in QUANTITIES.values()), "φ_f less Gravish's [%]"]
    rows = [
        [
            named(row),
            f"{row[ASPECT]:g}",
            str(row[SEEDS]),
            *(told_number(row[name], form, row[marked(name, "95 %")]) for name, (_, form) in QUANTITIES.items()),
            told_number(row[DEVIATION], "+.1f", row[marked(DEVIATION, "95 %")]),
        ]
        for _, row in table.iterrows()
    ]
    return header, rows
