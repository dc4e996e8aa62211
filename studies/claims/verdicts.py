"""What the studies under `results/` say of the paper's claims.

`claims.yaml` names for every claim the study that tests it and the finding there; verdict, numbers and what they rest
on are taken from the tables of that study alone, so that the list of claims holds no number of its own.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import pandas as pd
import yaml

from dem.errors import InputError
from postprocess.statistics.points import ASPECT, SEED, SEEDS

CLAIMS = Path(__file__).with_name("claims.yaml")

Verdict = Literal["reproduced", "partly", "not", "not resolved", "not testable", "no data"]

Engines = Literal["alike", "opposite", "links alone tells", "YADE alone tells"]
"""Verdicts of both engines on one finding: the same, one found and the other refused, or one not resolved."""

_FOUND: Mapping[str, Verdict] = {
    **dict.fromkeys(("found", "yes"), "reproduced"),
    **dict.fromkeys(("not found", "no"), "not"),
    **dict.fromkeys(("not resolved", "undetermined"), "not resolved"),
    "no data": "no data",
}


@dataclass(frozen=True, kw_only=True)
class Tested:
    """What one study says of a claim.

    Attributes:
        study: Folder under `results/`.
        verdict: Of its finding.
        ours: Its numbers.
        criterion: What its verdict asks for.
        basis: Smarticles, seeds and engine that it rests on.
        needed: What it would take, where the verdict is not resolved and that is known; else empty.
        instead: What a test of ours says where the paper's own cannot tell; None where there is none.
    """

    study: str
    verdict: Verdict
    ours: str
    criterion: str
    basis: str
    needed: str = ""
    instead: Tested | None = None

    @property
    def settled(self) -> Verdict:
        """The verdict by the paper's own test, or that of ours where the paper's does not resolve it."""
        unsettled = self.verdict in ("not resolved", "no data")
        return self.instead.verdict if unsettled and self.instead is not None else self.verdict


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim of the paper.

    Attributes:
        number: In the paper's order, from 1.
        part: Of the paper.
        says: The claim.
        text: By the rules of the paper's text; None where that was not tested.
        code: By those of its own code.
        yade: By those of the text on YADE, from results of their own; None where these have no such finding.
        code_on_yade: The same by the code.
        why: What decides the verdict, or why there is none.
    """

    number: int
    part: str
    says: str
    text: Tested | None
    code: Tested | None
    yade: Tested | None
    code_on_yade: Tested | None
    why: str

    @property
    def verdict(self) -> Verdict:
        """Of both together: partly where one finds it and the other does not; not where one finds the opposite."""
        tested = [one.settled for one in (self.text, self.code) if one is not None]
        known = set(tested) - {"no data"}
        if not known:
            return "no data" if tested else "not testable"
        return next(iter(known)) if len(known) == 1 else "partly" if "reproduced" in known else "not"

    @property
    def engines(self) -> Mapping[str, Engines]:
        """How the engines agree, by protocol, where the same finding was asked of both."""
        pairs = {"text": (self.text, self.yade), "code": (self.code, self.code_on_yade)}
        return {
            name: _agreement(links.verdict, yade.verdict)
            for name, (links, yade) in pairs.items()
            if links is not None and yade is not None and "no data" not in (links.verdict, yade.verdict)
        }


def _agreement(links: Verdict, yade: Verdict) -> Engines:
    if links == yade:
        return "alike"
    if links == "not resolved":
        return "YADE alone tells"
    return "links alone tells" if yade == "not resolved" else "opposite"


def claims(results: Path, listed: Path = CLAIMS) -> tuple[Claim, ...]:
    """Judge all claims by what the studies found.

    Args:
        results: Folder of the studies' results.
        listed: The list of claims.

    Raises:
        InputError: A study or a finding that the list names is not there.
    """

    @cache
    def read(study: str) -> _Findings:
        # A study that has been run has its results in a folder of its own.
        inside = results / study / "results"
        return _findings(inside if inside.is_dir() else results / study)

    found: list[Claim] = []
    for part in yaml.safe_load(listed.read_text(encoding="utf-8")):
        for entry in part["claims"]:
            text, code = entry.get("text"), entry.get("code")
            yade, code_on_yade = (
                _tested(read, [f"{named[0]}-yade", named[1]], optional=True)
                if named and (results / f"{named[0]}-yade").is_dir()
                else None
                for named in (text, code)
            )
            found.append(
                Claim(
                    number=len(found) + 1,
                    part=part["part"],
                    says=entry["says"],
                    text=_tested(read, text, entry.get("text_instead")),
                    code=_tested(read, code, entry.get("code_instead")),
                    yade=yade,
                    code_on_yade=code_on_yade,
                    why=entry.get("untested") or entry.get("why", ""),
                )
            )
    return tuple(found)


_Findings = tuple[Mapping[str, Sequence[str]], str]
"""Numbers, verdict, criterion and what is needed by id of the finding; what all of them rest on."""


def _tested(
    read: Callable[[str], _Findings],
    named: Sequence[str] | None,
    instead: Sequence[str] | None = None,
    *,
    optional: bool = False,
) -> Tested | None:
    """What a study says, named with its finding, and what another one says instead; None of none."""
    if named is None:
        return None
    study, finding = named
    findings, basis = read(study)
    if finding not in findings:
        if optional:
            return None
        msg = f"{study}: has no finding {finding!r}; correct studies/claims/claims.yaml"
        raise InputError(msg)
    ours, verdict, criterion, *needed = findings[finding]
    return Tested(
        study=study,
        verdict=_FOUND[verdict],
        ours=ours,
        criterion=criterion,
        basis=basis,
        needed=needed[0] if needed else "",
        instead=_tested(read, instead),
    )


def _findings(folder: Path) -> _Findings:
    """Read the findings of a study; questions of earlier studies by their sentence where they have no id."""
    for name, order in (("findings.csv", ("ours", "verdict", "criterion", "needed")), ("verdicts.csv", None)):
        path = folder / name
        if path.is_file():
            with path.open(encoding="utf-8", newline="") as file:
                header, *rows = [row for row in csv.reader(file) if not row[0].startswith("# ")]
            key = header.index("id") if "id" in header else 0
            # Absent in tables written before the column `needed` was added.
            columns = [2, 1, 0] if order is None else [header.index(one) for one in order if one in header]
            return {row[key]: [row[column] for column in columns] for row in rows}, _basis(folder)
    msg = f"{folder}: has neither findings.csv nor verdicts.csv; analyse the study first"
    raise InputError(msg)


def _basis(folder: Path) -> str:
    """`168 – 494 smarticles, l/w 0.4 – 1.1, 8 seeds, links`."""
    runs = pd.read_csv(folder / "runs.csv", comment="#")
    made = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))["runs"]
    engines = sorted({"links" if "links" in run["versions"] else "YADE" for run in made})
    # Seeds from the point with the fewest to that with the most; how many in all where no table tells of points.
    points = [folder / name for name in ("points.csv", "summary.csv") if (folder / name).is_file()]
    counts = next((table[SEEDS] for path in points if SEEDS in (table := pd.read_csv(path, comment="#"))), None)
    seeds = _span(counts) if counts is not None else str(runs[SEED].nunique())
    parts = [f"{_span(runs['smarticles [-]'])} smarticles", *([f"l/w {_span(runs[ASPECT])}"] if ASPECT in runs else [])]
    return ", ".join([*parts, f"{seeds} seed{'' if seeds == '1' else 's'}", " and ".join(engines)])


def _span(values: pd.Series) -> str:
    least, most = values.min(), values.max()
    return f"{least:g}" if least == most else f"{least:g} – {most:g}"
