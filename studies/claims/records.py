"""Claims as data for other programs: `claims.yaml` and its JSON schema."""

import json
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Literal

import yaml
from pydantic import BaseModel, ConfigDict

from studies.claims.verdicts import Claim, Tested
from studies.framework.findings import CRITERION
from studies.registry import FOLDER, STUDIES, shipped
from templates.sweep.sweep_file import load_sweep

SCHEMA = "claims.schema.json"
REPOSITORY = FOLDER.parent

Verdict = Literal["reproduced", "not", "partly", "not resolved", "no data", "not testable"]
_TABLES = ("findings.csv", "verdicts.csv", "runs.csv", "points.csv", "summary.csv", "provenance.json")


class Record(BaseModel):
    """Part of `claims.yaml`; unknown keys are rejected."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)


class TestRecord(Record):
    """One test of a claim: the finding of a study."""

    rules: Literal["text", "code"]
    """Rules of the runs: those of the paper's text, or of its code."""
    other_engine: bool
    """Whether the test repeats another one on YADE; it is then no part of the claim's verdict."""
    of_ours: bool
    """Whether the test is ours and not the paper's; it decides where the paper's own does not resolve the claim."""
    study: str
    """Study, `smarticles study STUDY`, or for results without a shipped sweep the folder under results/."""
    finding: str
    """Id of the finding in the tables and in the script."""
    script: str
    """Analysis: path in the repository."""
    sweep: str
    """Sweep file with the variant that was run, FILE@VARIANT: path in the repository."""
    template: str
    """Template of the scenes: path in the repository."""
    tables: list[str]
    """Tables that the verdict rests on, and the provenance of their runs: paths in results/."""
    verdict: Verdict
    """Verdict of this test."""
    numbers: str
    """Our numbers with standard errors."""
    tolerance: str
    """Criterion for the verdict `reproduced`, as the script has it; see `ClaimsRecord.tolerance`."""
    runs: str
    """Smarticles, aspect ratios, seeds and engine of the runs."""
    needed: str
    """What would resolve the claim; empty if it is resolved or that is unknown."""


class ClaimRecord(Record):
    """One claim of the paper."""

    id: str
    """Identifier, `savoie2023-NN`; NN is the number in the order of the paper, and in CLAIMS.md."""
    part: str
    """Section of the paper."""
    statement: str
    """What the paper says, in our words."""
    verdict: Verdict
    """Verdict from the tests of both rules together."""
    why: str
    """Reason for the verdict, or for having none; may be empty."""
    tests: list[TestRecord]
    """Tests of the claim; empty if it is not testable."""


class ClaimsRecord(Record):
    """Content of `claims.yaml`."""

    paper: str
    """DOI of the paper."""
    made_by: str
    """Command that makes this file from the tables of the studies."""
    tolerance: str
    """Definition of the verdicts, common to all tests."""
    claims: list[ClaimRecord]
    """All claims in the order of the paper."""


def records(found: Sequence[Claim], results: Path) -> ClaimsRecord:
    """Make the content of `claims.yaml`; `results` is the folder of the tables."""
    return ClaimsRecord(
        paper="10.1039/d2sm01573k",
        made_by="make claims",
        tolerance=f"{CRITERION}. Reproduced: found under all rules that it was tested under; partly: under one of "
        "them; not: under none, and the opposite under one at least.",
        claims=[
            ClaimRecord(
                id=f"savoie2023-{claim.number:02d}",
                part=claim.part,
                statement=claim.says,
                verdict=claim.verdict,
                why=claim.why,
                tests=list(_tests(claim, results)),
            )
            for claim in found
        ],
    )


def _tests(claim: Claim, results: Path) -> Iterator[TestRecord]:
    for name, tested in claim.tested.items():
        rules, other_engine = name.removesuffix(" on YADE"), name.endswith(" on YADE")
        for one, of_ours in ((tested, False), (tested and tested.instead, True)):
            if one is not None:
                yield _test(one, results, rules=rules, other_engine=other_engine, of_ours=of_ours)


def _test(one: Tested, results: Path, *, rules: str, other_engine: bool, of_ours: bool) -> TestRecord:
    script, sweep, template = files_of(one.study if one.study in STUDIES else one.study.removesuffix("-yade"))
    inside = Path(one.study, "results") if (results / one.study / "results").is_dir() else Path(one.study)
    return TestRecord(
        rules=rules,
        other_engine=other_engine,
        of_ours=of_ours,
        study=one.study,
        finding=one.finding,
        script=script,
        sweep=sweep,
        template=template,
        tables=[(inside / table).as_posix() for table in _TABLES if (results / inside / table).is_file()],
        verdict=one.verdict,
        numbers=one.ours,
        tolerance=one.criterion,
        runs=one.basis,
        needed=one.needed,
    )


@cache
def files_of(study: str) -> tuple[str, str, str]:
    """Return the paths of script, sweep file and template of a shipped study in the repository."""
    script, sweep = shipped(study), shipped(study).sweep_file()
    paths = (FOLDER / f"{script.module}.py", sweep, load_sweep(sweep).template)
    first, second, third = (path.relative_to(REPOSITORY).as_posix() for path in paths)
    return first, second, third


def write_records(found: Sequence[Claim], results: Path) -> None:
    """Write `claims.yaml` and its schema into a folder of results."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **ClaimsRecord.model_json_schema()}
    (results / SCHEMA).write_text(json.dumps(schema, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    content = records(found, results).model_dump(mode="json")
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)
    (results / "claims.yaml").write_text(f"# yaml-language-server: $schema={SCHEMA}\n{text}", encoding="utf-8")
