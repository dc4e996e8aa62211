"""Verdicts on the paper's claims, read from the published tables of the studies.

`claims.yaml` names for every claim a study and one of its findings. Verdict, numbers and runs come from the tables of
that study in `results/`, so that `claims.yaml` holds no number of its own.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pandas as pd
import yaml

from dem.errors import InputError
from postprocess.statistics.points import ASPECT, SEED, SEEDS

CLAIMS = Path(__file__).with_name("claims.yaml")
ON_YADE = {"procedures-main-rigid": "procedures-code-yade"}  #: Studies on YADE of others than STUDY-yade, by study

_FOUND = {
    **dict.fromkeys(("found", "yes"), "reproduced"),
    **dict.fromkeys(("not found", "no"), "not"),
    **dict.fromkeys(("not resolved", "undetermined"), "not resolved"),
    "no data": "no data",
}


@dataclass(frozen=True, kw_only=True)
class Tested:
    """Verdict of one study on a claim."""

    study: str  #: Folder under `results/`
    finding: str  #: Id of the finding in that study
    verdict: str  #: `reproduced`, `not`, `not resolved` or `no data`
    ours: str  #: Our numbers, as text
    criterion: str  #: Criterion for the verdict `reproduced`
    basis: str  #: Smarticles, aspect ratios, seeds and engine of the runs, as text
    needed: str = ""  #: Text on how many more runs would resolve the claim; empty if resolved or unknown
    instead: Tested | None = None  #: Verdict of a test of ours, used if the paper's test does not resolve the claim

    @property
    def settled(self) -> str:
        """Verdict of the paper's test, or of our own test if the paper's test does not resolve the claim."""
        unsettled = self.verdict in ("not resolved", "no data")
        return self.instead.verdict if unsettled and self.instead is not None else self.verdict


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim of the paper, with the verdicts of the studies that tested it."""

    number: int  #: Number in the order of the paper, from 1
    part: str  #: Section of the paper
    says: str  #: The claim
    #: Verdicts under the protocols `text` and `code`, and in the results `text on YADE` and `code on YADE`; None if not
    #: tested
    tested: Mapping[str, Tested | None]
    why: str  #: Reason for the verdict, or for having none

    @property
    def verdict(self) -> str:
        """Verdict from both protocols together: the rules of the paper's text, and those of the paper's code.

        A protocol without data does not count. If both agree, it is their common verdict: `reproduced`, `not`, or `not
        resolved`. If they differ, it is `partly` if one reproduces the claim, else `not`. It is `no data` if there are
        no data, and `not testable` if no study tested the claim.
        """
        settled = [one.settled for one in (self.tested["text"], self.tested["code"]) if one is not None]
        known = set(settled) - {"no data"}
        if not known:
            return "no data" if settled else "not testable"
        return next(iter(known)) if len(known) == 1 else "partly" if "reproduced" in known else "not"

    @property
    def engines(self) -> dict[str, str]:
        """Agreement of both engines by protocol: `alike`, `opposite`, `links alone`, or `YADE alone`.

        "alone" means that only this engine resolves the claim. Protocols not tested on both engines are left out.
        """
        found = {}
        for name in ("text", "code"):
            verdicts = [one.verdict for one in (self.tested[name], self.tested[f"{name} on YADE"]) if one is not None]
            if len(verdicts) == 2 and "no data" not in verdicts:
                links, yade = verdicts
                resolves = "YADE alone" if links == "not resolved" else "links alone" if yade == "not resolved" else ""
                found[name] = "alike" if links == yade else resolves or "opposite"
        return found


def claims(results: Path, listed: Path = CLAIMS) -> tuple[Claim, ...]:
    """Read the verdicts on the claims in the YAML file `listed` from the published tables of the studies.

    `results` has a folder for each study. InputError if a study or a finding that the list names does not exist.
    """

    @cache
    def read(study: str) -> _Findings:
        # `smarticles study` writes results/ inside the folder of the study; published results have no such folder.
        inside = results / study / "results"
        return _findings(inside if inside.is_dir() else results / study)

    found: list[Claim] = []
    for part in yaml.safe_load(listed.read_text(encoding="utf-8")):
        for entry in part["claims"]:
            tested = {}
            for name in ("text", "code"):
                named = entry.get(name)
                tested[name] = _tested(read, named, entry.get(f"{name}_instead"))
                yade = named and [ON_YADE.get(named[0], f"{named[0]}-yade"), named[1]]
                there = yade and (results / yade[0]).is_dir()
                tested[f"{name} on YADE"] = _tested(read, yade, optional=True) if there else None
            why = entry.get("untested") or entry.get("why", "")
            found.append(Claim(number=len(found) + 1, part=part["part"], says=entry["says"], tested=tested, why=why))
    return tuple(found)


_Findings = tuple[Mapping[str, Mapping[str, str]], str]  #: Rows of `findings.csv` by id, and `Tested.basis`


def _tested(
    read: Callable[[str], _Findings],
    named: Sequence[str] | None,
    instead: Sequence[str] | None = None,
    *,
    optional: bool = False,
) -> Tested | None:
    """Read the verdict of a finding from the tables of its study; None if `named` is None.

    Args:
        read: returns the findings of a study.
        named: name of the study and id of the finding.
        instead: the same for a test of our own, whose verdict is used if `named` does not resolve the claim.
        optional: return None if the study lacks the finding; otherwise raise InputError.
    """
    if named is None:
        return None
    study, finding = named
    findings, basis = read(study)
    if finding not in findings:
        if optional:
            return None
        raise InputError(f"{study}: has no finding {finding!r}; correct studies/claims/claims.yaml")
    row = findings[finding]
    return Tested(
        study=study,
        finding=finding,
        verdict=_FOUND[row["verdict"]],
        ours=row["ours"],
        criterion=row["criterion"],
        basis=basis,
        needed=row.get("needed", ""),  # absent in tables written before the column was added
        instead=_tested(read, instead),
    )


def _findings(folder: Path) -> _Findings:
    """Read the findings of a study: rows of its table by id, and a text on the runs that they rest on.

    Findings of a table without ids are listed by their statement. The text is the one of `_basis`.
    """
    for name in ("findings.csv", "verdicts.csv"):
        path = folder / name
        if path.is_file():
            with path.open(encoding="utf-8", newline="") as file:
                header, *rows = [row for row in csv.reader(file) if not row[0].startswith("# ")]
            if name == "verdicts.csv":
                header = ["criterion", "verdict", "ours", *header[3:]]
            key = header.index("id") if "id" in header else 0
            return {row[key]: dict(zip(header, row, strict=True)) for row in rows}, _basis(folder)
    raise InputError(f"{folder}: has neither findings.csv nor verdicts.csv; analyse the study first")


def _basis(folder: Path) -> str:
    """Format the runs that findings rest on: `168 – 494 smarticles, l/w 0.4 – 1.1, 8 seeds, links`."""
    runs = pd.read_csv(folder / "runs.csv", comment="#")
    made = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))["runs"]
    engines = sorted({"links" if "links" in run["versions"] else "YADE" for run in made})
    # Least and greatest number of seeds at a point; without a table of points, the number of all seeds.
    points = [folder / name for name in ("points.csv", "summary.csv") if (folder / name).is_file()]
    counts = next((table[SEEDS] for path in points if SEEDS in (table := pd.read_csv(path, comment="#"))), None)
    seeds = _span(counts) if counts is not None else str(runs[SEED].nunique())
    parts = [f"{_span(runs['smarticles [-]'])} smarticles", *([f"l/w {_span(runs[ASPECT])}"] if ASPECT in runs else [])]
    return ", ".join([*parts, f"{seeds} seed{'' if seeds == '1' else 's'}", " and ".join(engines)])


def _span(values: pd.Series) -> str:
    least, most = values.min(), values.max()
    return f"{least:g}" if least == most else f"{least:g} – {most:g}"
