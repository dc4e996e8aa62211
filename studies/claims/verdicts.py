"""What the studies under `results/` say of the paper's claims.

`claims.yaml` names for every claim the study that tests it and the finding there; verdict, numbers and what they rest
on are taken from the tables of that study alone, so that the list of claims holds no number of its own.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd
import yaml

from dem.errors import InputError
from postprocess.statistics.columns import ASPECT, SEED, SEEDS

CLAIMS = Path(__file__).with_name("claims.yaml")

Verdict = Literal["reproduced", "partly", "not", "not resolved", "not testable", "no data"]

Engines = Literal["alike", "opposite", "links alone tells", "YADE alone tells"]
"""Verdicts of both engines on one finding: the same, one found and the other refused, or one not resolved."""

_FOUND: Mapping[str, Verdict] = {
    "found": "reproduced",
    "not found": "not",
    "not resolved": "not resolved",
    "no data": "no data",
    "yes": "reproduced",
    "no": "not",
    "undetermined": "not resolved",
}
_COUNT = "smarticles [-]"

RESULTS = "results"
"""Folder of the results within that of a study which has been run."""

ON_YADE = "-yade"
"""What the folder of a study's results on YADE is called beside that of its results on links."""


@dataclass(frozen=True, kw_only=True)
class Tested:
    """What one study says of a claim.

    Attributes:
        study: Folder under `results/`.
        verdict: Of its finding.
        ours: Its numbers.
        criterion: What its verdict asks for.
        basis: Smarticles, seeds and engine that it rests on.
        needed: What it would take, where the verdict is not resolved and that is told; else empty.
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
        told = {verdict for verdict in tested if verdict != "no data"}
        if not tested:
            return "not testable"
        if not told:
            return "no data"
        if len(told) == 1:
            return told.pop()
        return "partly" if "reproduced" in told else "not"

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
    """All claims with what the studies found.

    Args:
        results: Folder of the studies' results.
        listed: The list of claims.

    Raises:
        InputError: A study or a finding that the list names is not there.
    """
    tables = _Tables(results)
    found: list[Claim] = []
    for part, entry in _entries(listed):
        found.append(
            Claim(
                number=len(found) + 1,
                part=part,
                says=entry["says"],
                text=tables.tested(entry.get("text"), entry.get("text_instead")),
                code=tables.tested(entry.get("code"), entry.get("code_instead")),
                yade=tables.on_yade(entry.get("text")),
                code_on_yade=tables.on_yade(entry.get("code")),
                why=entry.get("untested") or entry.get("why", ""),
            )
        )
    return tuple(found)


def _entries(listed: Path) -> Iterator[tuple[str, Mapping[str, str]]]:
    for part in yaml.safe_load(listed.read_text(encoding="utf-8")):
        for entry in part["claims"]:
            yield part["part"], entry


class _Tables:
    """Findings of studies, read once."""

    def __init__(self, results: Path) -> None:
        self._results = results
        self._found: dict[str, dict[str, Sequence[str]]] = {}
        self._bases: dict[str, str] = {}

    def tested(self, named: Sequence[str] | None, instead: Sequence[str] | None = None) -> Tested | None:
        """What a study says, named with its finding, and what another one does instead; None of none."""
        if named is None:
            return None
        study, finding = named
        self._open(study)
        try:
            ours, verdict, criterion, *needed = self._found[study][finding]
        except KeyError:
            msg = f"{self._results / study}: has no finding {finding!r}; correct studies/claims/claims.yaml"
            raise InputError(msg) from None
        return Tested(
            study=study,
            verdict=_FOUND[verdict],
            ours=ours,
            criterion=criterion,
            basis=self._bases[study],
            needed=needed[0] if needed else "",
            instead=self.tested(instead),
        )

    def on_yade(self, named: Sequence[str] | None) -> Tested | None:
        """What the same finding is in the results of the study on YADE, where there are such."""
        if named is None or not (self._results / f"{named[0]}{ON_YADE}").is_dir():
            return None
        study, finding = f"{named[0]}{ON_YADE}", named[1]
        self._open(study)
        return self.tested((study, finding)) if finding in self._found[study] else None

    def _open(self, study: str) -> None:
        """Read a study, if it has not been; a study that has been run has its results in a folder of its own."""
        if study not in self._found:
            inside = self._results / study / RESULTS
            folder = inside if inside.is_dir() else self._results / study
            self._found[study], self._bases[study] = _read(folder), _basis(folder)


def _read(folder: Path) -> dict[str, Sequence[str]]:
    """Numbers, verdict and criterion by id of the finding, and by its sentence in tables without ids."""
    for name, order in (("findings.csv", ("ours", "verdict", "criterion", "needed")), ("verdicts.csv", None)):
        path = folder / name
        if path.is_file():
            with path.open(encoding="utf-8", newline="") as file:
                header, *rows = [row for row in csv.reader(file) if not row[0].startswith("# ")]
            key = header.index("id") if "id" in header else 0
            # Absent in tables written before the column `needed` was added.
            columns = [2, 1, 0] if order is None else [header.index(one) for one in order if one in header]
            return {row[key]: [row[column] for column in columns] for row in rows}
    msg = f"{folder}: has neither findings.csv nor verdicts.csv; analyse the study first"
    raise InputError(msg)


def _basis(folder: Path) -> str:
    """`168 – 494 smarticles, l/w 0.4 – 1.1, 8 seeds, links`."""
    runs = pd.read_csv(folder / "runs.csv", comment="#")
    made = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))["runs"]
    engines = sorted({"links" if "links" in run["versions"] else "YADE" for run in made})
    parts = [f"{_span(runs[_COUNT])} smarticles"]
    if ASPECT in runs:
        parts.append(f"l/w {_span(runs[ASPECT])}")
    seeds = _seeds(folder, runs)
    parts += [f"{seeds} seed{'' if seeds == '1' else 's'}", " and ".join(engines)]
    return ", ".join(parts)


def _seeds(folder: Path, runs: pd.DataFrame) -> str:
    """From the point with the fewest to that with the most; how many in all where no table tells of points."""
    for name in ("points.csv", "summary.csv"):
        if (folder / name).is_file():
            points = pd.read_csv(folder / name, comment="#")
            if SEEDS in points:
                return _span(points[SEEDS])
    return str(runs[SEED].nunique())


def _span(values: pd.Series) -> str:
    least, most = values.min(), values.max()
    return f"{least:g}" if least == most else f"{least:g} – {most:g}"
