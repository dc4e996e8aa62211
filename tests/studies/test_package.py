"""What archives and other programs read of results/: checksums, the crate, and claims as data."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import ValidationError

from postprocess.report.crate import NAME
from studies.claims.records import SCHEMA, ClaimsRecord, records, write_records
from studies.claims.verdicts import claims
from studies.package import REPOSITORY, SUMS, write_package

RESULTS = REPOSITORY / "results"
RENEW = "run `make claims`"


def read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return content


def test_claims_as_data_are_those_of_the_tables(tmp_path: Path) -> None:
    found = claims(RESULTS)
    shipped = ClaimsRecord.model_validate(read(RESULTS / "claims.yaml"))
    assert shipped == records(found, RESULTS), RENEW
    write_records((), tmp_path)
    assert (RESULTS / SCHEMA).read_text() == (tmp_path / SCHEMA).read_text(), RENEW
    ids = [claim.id for claim in shipped.claims]
    assert ids == sorted(set(ids))
    for claim in shipped.claims:
        assert claim.tests or claim.why
        for test in claim.tests:
            assert test.tolerance
            assert test.numbers
            for name in (test.script, test.sweep.partition("@")[0], test.template):
                assert (REPOSITORY / name).is_file(), name
            assert {"runs.csv", "provenance.json"} <= {Path(name).name for name in test.tables}
            assert all((RESULTS / name).is_file() for name in test.tables)


@pytest.mark.parametrize("change", [{"verdict": "perhaps"}, {"colour": "red"}, {"tests": [{}]}])
def test_the_schema_rejects_what_is_no_claim(change: dict[str, Any]) -> None:
    content = read(RESULTS / "claims.yaml")
    content["claims"][3] |= change
    with pytest.raises(ValidationError):
        ClaimsRecord.model_validate(content)


def test_checksums_and_crate_are_those_of_the_results(tmp_path: Path) -> None:
    write_package(REPOSITORY, tmp_path)
    for name in (f"results/{SUMS}", NAME):
        assert (REPOSITORY / name).read_text() == (tmp_path / name).read_text(), RENEW
    subprocess.run(["sha256sum", "--check", "--quiet", "--strict", SUMS], cwd=RESULTS, check=True)


def test_the_crate_has_every_folder_with_runs() -> None:
    shipped = json.loads((REPOSITORY / NAME).read_text(encoding="utf-8"))["@graph"]
    entities = {one["@id"]: one for one in shipped}
    assert len(entities) == len(shipped)
    actions = [one for one in shipped if one["@type"] == "CreateAction"]
    made = {action["result"]["@id"] for action in actions}
    assert made == {f"{path.parent.relative_to(REPOSITORY)}/" for path in RESULTS.rglob("provenance.json")}
    # Every reference leads to an entity, and every file of the crate is there.
    for one in shipped:
        values = [value if isinstance(value, list) else [value] for value in one.values()]
        references = [part["@id"] for value in values for part in value if isinstance(part, dict)]
        assert all(name in entities or name.startswith("https://w3id.org/") for name in references)
    parts = [part["@id"] for part in entities["./"]["hasPart"]]
    assert all((REPOSITORY / name).exists() for name in parts)
