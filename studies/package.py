"""Describe the published results for archives: `python -m studies.package`.

It writes `results/SHA256SUMS`, which `sha256sum --check` reads, and `ro-crate-metadata.json`, which makes the
repository a Workflow Run RO-Crate: each folder of results is the result of an action, whose instrument is the script of
a study. `provenance.json` in each folder has the runs one by one.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import yaml

from postprocess.report.crate import NAME, Entity, part, refer, write_crate
from studies.claims.records import REPOSITORY, files_of
from studies.registry import FOLDER, STUDIES

SUMS = "SHA256SUMS"
_SUMMED = ("*.csv", "*.json", "*.yaml")  # tables, their provenance, scenes and sweeps beside them
_LICENCE, _AUTHORS, _PROVENANCE = "https://spdx.org/licenses/MIT", "#authors", "provenance.json"


def checksums(results: Path) -> str:
    """Return the text of `SHA256SUMS`: checksum and path of each table, in the order of the paths."""
    paths = sorted(path for pattern in _SUMMED for path in results.rglob(pattern))
    return "".join(
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(results).as_posix()}\n" for path in paths
    )


def write_package(repository: Path, output: Path) -> None:
    """Write checksums and metadata of the crate of a repository into `output`, which is normally the repository."""
    results = repository / "results"
    (output / "results").mkdir(exist_ok=True)
    (output / "results" / SUMS).write_text(checksums(results), encoding="utf-8")
    citation = yaml.safe_load((repository / "CITATION.cff").read_text(encoding="utf-8"))
    folders = [path.parent for path in sorted(results.rglob(_PROVENANCE))]
    made = {folder: json.loads((folder / _PROVENANCE).read_text(encoding="utf-8")) for folder in folders}
    inputs = {folder: [*_inputs(repository, folder, made[folder]["study"])] for folder in folders}
    parts = [
        *(part(repository, folder) for folder in folders),
        *(part(repository, results / name) for name in ("claims.yaml", SUMS)),
        *(_source(repository, name, citation["version"]) for name in sorted({*chain(*inputs.values())})),
    ]
    root = {
        "name": citation["title"],
        "description": citation["abstract"],
        "datePublished": citation["date-released"],
        "license": refer(_LICENCE),
        "author": refer(_AUTHORS),
        "publisher": refer(_AUTHORS),
        "keywords": citation["keywords"],
    }
    others: list[Entity] = [
        {"@id": _LICENCE, "@type": "CreativeWork", "name": "MIT licence", "description": "File LICENSE"},
        {"@id": _AUTHORS, "@type": "Organization", "name": citation["authors"][0]["name"]},
        *(_action(repository, folder, made[folder], inputs[folder]) for folder in folders),
    ]
    write_crate(output / NAME, root, parts, others)


def _source(repository: Path, name: str, version: str) -> Entity:
    found = part(repository, repository / name)
    if not name.endswith(".py"):
        return found
    kind = ["File", "SoftwareSourceCode"]
    return {**found, "@type": kind, "programmingLanguage": "Python", "version": version}


def _action(repository: Path, folder: Path, made: Mapping[str, Any], inputs: Sequence[str]) -> Entity:
    """Make the action that a folder of results came from; `made` is its provenance, its script the first input."""
    name, runs, (script, *others) = folder.relative_to(repository).as_posix(), made["runs"], inputs
    return {
        "@id": f"#{name}",
        "@type": "CreateAction",
        "name": f"{name}: {len(runs)} runs of study {made['study']}",
        "description": f"{made['command']}. {made['footer'][-1]}",
        "instrument": refer(script),
        "object": refer(*others),
        "result": refer(f"{name}/"),
        "startTime": min(run["started"] for run in runs),
        "agent": refer(_AUTHORS),
        "actionStatus": "http://schema.org/CompletedActionStatus",
    }


def _inputs(repository: Path, folder: Path, study: str) -> Iterator[str]:
    """Yield the paths of the script, and of the sweep files or scenes, of a folder of results."""
    beside = [path.relative_to(repository).as_posix() for path in sorted(folder.glob("*.yaml"))]
    if study not in STUDIES:  # the ladder of `smarticles accuracy`, whose scene is beside it
        yield (FOLDER / "accuracy.py").relative_to(REPOSITORY).as_posix()
        yield from beside
        return
    script, sweep, template = files_of(study)
    yield script
    yield from beside or dict.fromkeys((sweep.partition("@")[0], template))


if __name__ == "__main__":
    write_package(REPOSITORY, REPOSITORY)
    print(f"results/{SUMS}, {NAME}: written")
