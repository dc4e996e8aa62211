"""Studies of questions that runs answer, each with the numbers behind the answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import pandas as pd

from postprocess.report.markdown import table_lines
from studies.base.study import Analysis, Study, Tables

YesNo = Literal["yes", "no", "undetermined"]


@dataclass(frozen=True, kw_only=True)
class Question:
    """A question of a study, answered.

    Attributes:
        question: Ends in a question mark.
        answer: "undetermined" where the data cannot tell.
        evidence: The numbers behind it.
    """

    question: str
    answer: YesNo
    evidence: str

    @property
    def told(self) -> str:
        """Question, answer and evidence for the terminal."""
        return f"{self.question} {self.answer.upper()}\n    {self.evidence}"


def above_zero(value: float, half_width: float) -> YesNo:
    """Whether a value is clearly above 0: yes or no beyond its 95 % half-width, undetermined without one."""
    if value > half_width:
        return "yes"
    return "no" if value < -half_width else "undetermined"


def questions_lines(judged: Sequence[Question]) -> Sequence[str]:
    """A table of Markdown, one row per question."""
    rows = [(one.question, f"**{one.answer}**", one.evidence) for one in judged]
    return table_lines(["question", "answer", "evidence"], rows)


def questions_table(judged: Sequence[Question]) -> pd.DataFrame:
    """One row per question."""
    return pd.DataFrame([asdict(one) for one in judged])


class QuestionStudy(Study[Question]):
    """A study that answers questions: it writes them as a table, and tells each with its answer below that of points.

    Attributes:
        answers_name: Of the table of questions, without suffix.
        about_numbers: What the numbers of the table for the terminal are; empty if its header says so.
    """

    answers_name = "answers"
    about_numbers = ""

    def judged_tables(self, judged: tuple[Question, ...]) -> Tables:
        """One row per question."""
        return {self.answers_name: questions_table(judged)}

    def told(self, analysis: Analysis[Question]) -> Sequence[str]:
        """What the numbers are, and questions with their answers."""
        return [*([self.about_numbers, ""] if self.about_numbers else []), *(one.told for one in analysis.judged)]
