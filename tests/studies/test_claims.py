"""The list of claims: what it takes from the studies, what it makes of two protocols, and the one that is shipped."""

import csv
import json
from collections import defaultdict
from pathlib import Path

import pytest
import yaml

from dem.errors import InputError
from studies.claims.__main__ import text
from studies.claims.verdicts import CLAIMS, Claim, claims

RESULTS = Path(__file__).parents[2] / "results"
MOST, HIGHEST = "shape change entangles most", "shape-change-most-entangled"
BY_CODE, BY_CODE_ON_YADE = "procedures-main-rigid", "procedures-code-yade"  # studies that test it


def written(folder: Path, verdicts: dict[tuple[str, str], str]) -> Path:
    """Results of all studies that the list names; every finding is found but those that `verdicts` has."""
    named = defaultdict(list)
    for part in yaml.safe_load(CLAIMS.read_text(encoding="utf-8")):
        for entry in part["claims"]:
            for key in ("text", "code", "text_instead", "code_instead"):
                if key in entry and entry[key][1] not in named[entry[key][0]]:
                    named[entry[key][0]].append(entry[key][1])
    named[BY_CODE_ON_YADE] = named[BY_CODE]
    for study, findings in named.items():
        (folder / study).mkdir(parents=True)
        with (folder / study / "findings.csv").open("w", encoding="utf-8", newline="") as file:
            out = csv.writer(file)
            out.writerow(("finding in the paper", "ours", "verdict", "criterion", "needed", "id"))
            for one in findings:
                out.writerow((one, "ours", verdicts.get((study, one), "found"), "criterion", "three runs", one))
            file.write(f"# Study {study}\n")
        rows = "seed,smarticles [-],aspect ratio [-]\n1,494,0.4\n2,168,1.1\n# Study\n"
        (folder / study / "runs.csv").write_text(rows)
        (folder / study / "provenance.json").write_text(json.dumps({"runs": [{"versions": {"links": "x"}}]}))
    return folder


def one_of(found: tuple[Claim, ...], says: str) -> Claim:
    """The claim that says so."""
    (claim,) = [claim for claim in found if claim.says == says]
    return claim


def test_a_claim_rests_on_what_its_studies_say(tmp_path: Path) -> None:
    folder = written(tmp_path, {})
    (folder / BY_CODE / "points.csv").write_text("point,seeds [-]\na,16\nb,8\n# Study\n")
    found = claims(folder)
    assert [claim.number for claim in found] == list(range(1, len(found) + 1))
    assert {claim.verdict for claim in found} == {"reproduced", "not testable"}
    most = one_of(found, MOST)
    assert {name: one.basis for name, one in most.tested.items() if one is not None} == {
        "text": "168 – 494 smarticles, l/w 0.4 – 1.1, 2 seeds, links",
        "code": "168 – 494 smarticles, l/w 0.4 – 1.1, 8 – 16 seeds, links",
        "code on YADE": "168 – 494 smarticles, l/w 0.4 – 1.1, 2 seeds, links",
    }


@pytest.mark.parametrize(
    ("by_text", "by_code", "verdict"),
    [
        ("not found", "found", "partly"),
        ("not resolved", "found", "partly"),
        ("not found", "not found", "not"),
        ("not found", "not resolved", "not"),
        ("not resolved", "not resolved", "not resolved"),
        ("no data", "found", "reproduced"),
        ("no data", "no data", "no data"),
    ],
)
def test_two_protocols_make_one_verdict(tmp_path: Path, by_text: str, by_code: str, verdict: str) -> None:
    results = written(tmp_path, {("procedures", HIGHEST): by_text, (BY_CODE, HIGHEST): by_code})
    claim = one_of(claims(results), MOST)
    assert claim.verdict == verdict
    assert f"**{verdict}**" in text((claim,))
    assert f"| {verdict}: ours; three runs |" in text((claim,)) or by_text != by_code


@pytest.mark.parametrize(
    ("by_theirs", "by_ours", "verdict"),
    [
        ("not resolved", "found", "reproduced"),
        ("not resolved", "not found", "not"),
        ("no data", "found", "reproduced"),
        ("not resolved", "not resolved", "not resolved"),
        ("not found", "found", "not"),
    ],
)
def test_our_test_decides_where_theirs_is_not_resolved(
    tmp_path: Path, by_theirs: str, by_ours: str, verdict: str
) -> None:
    strongest = "shape-change-strongest"
    theirs = {(study, strongest): by_theirs for study in ("fracture", "fracture-code")}
    ours = {(study, strongest): by_ours for study in ("strength-main", "strength-main-rigid")}
    claim = one_of(claims(written(tmp_path, theirs | ours)), "shape change has the highest peak force")
    assert claim.verdict == verdict
    assert "; by a test of ours, strength-main-rigid: " in text((claim,))


def test_a_claim_has_the_study_that_tests_it_on_yade(tmp_path: Path) -> None:
    claim = one_of(claims(written(tmp_path, {(BY_CODE_ON_YADE, HIGHEST): "not found"})), MOST)
    on_yade = claim.tested["code on YADE"]
    assert on_yade is not None
    assert (on_yade.study, on_yade.verdict) == (BY_CODE_ON_YADE, "not")
    assert claim.verdict == "reproduced"  # YADE is no part of it
    assert claim.engines["code"] == "opposite"


def test_a_finding_that_is_not_there_is_named(tmp_path: Path) -> None:
    results = written(tmp_path, {})
    findings = results / "chain" / "findings.csv"
    findings.write_text(findings.read_text().replace("widens", "narrows"))
    with pytest.raises(InputError, match="chain: has no finding 'widens'"):
        claims(results)
    findings.unlink()
    with pytest.raises(InputError, match=r"chain: has neither findings\.csv nor"):
        claims(results)


def test_what_is_shipped_says_what_the_tables_beside_it_say() -> None:
    found = claims(RESULTS)
    assert (RESULTS / "CLAIMS.md").read_text(encoding="utf-8") == text(found), "run `make claims`"
    # Nothing is claimed without a number: every claim that was tested has ours, and every other one says why not.
    for claim in found:
        tested = [one for one in (claim.tested["text"], claim.tested["code"]) if one is not None]
        assert all(one.ours for one in tested)
        assert tested or claim.why
