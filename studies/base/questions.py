"""Questions that a study answers by its runs, each with the numbers behind the answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import pandas as pd

from postprocess.report.markdown import table_lines

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


def questions_lines(judged: Sequence[Question]) -> Sequence[str]:
    """A table of Markdown, one row per question."""
    rows = [(one.question, f"**{one.answer}**", one.evidence) for one in judged]
    return table_lines(["question", "answer", "evidence"], rows)


def questions_table(judged: Sequence[Question]) -> pd.DataFrame:
    """One row per question."""
    return pd.DataFrame([asdict(one) for one in judged])
