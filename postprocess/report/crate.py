"""Write metadata of runs and results as RO-Crates of the profile Process Run Crate 0.5.

The profile is the part of Workflow Run RO-Crate for programs that are run one by one. Entities are JSON-LD objects with
an `@id`; `write_crate` adds the descriptor, the root and the profile, which all crates have.
Source: https://www.researchobject.org/workflow-run-crate/profiles/process_run_crate/
"""

import json
import mimetypes
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from dem.errors import InputError
from dem.record.names import LOCK, MANIFEST, SCENE, is_partial
from dem.record.run import Run, open_run
from postprocess.report.tables import whole_file

NAME = "ro-crate-metadata.json"  #: File name, which the format fixes
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
ROOT = "./"

Entity = Mapping[str, Any]  #: One JSON-LD object

_CONTEXT = ["https://w3id.org/ro/crate/1.1/context", "https://w3id.org/ro/terms/workflow-run/context"]
_TYPES = {".vtu": "model/vnd.vtk", ".pvd": "application/xml", ".h5": "application/x-hdf5", ".yaml": "application/yaml"}
_SMARTICLES = "#smarticles"
_UNSTATED = "none stated; whoever publishes this run states one here"


def refer(*ids: str) -> dict[str, str] | list[dict[str, str]]:
    """Return references to entities by their ids: one without a list, as the format recommends."""
    found = [{"@id": one} for one in ids]
    return found[0] if len(found) == 1 else found


def part(folder: Path, path: Path, **more: Any) -> Entity:
    """Make the entity of a file or folder below the folder of the crate."""
    name = path.relative_to(folder).as_posix()
    if path.is_dir():
        return {"@id": f"{name}/", "@type": "Dataset", "name": name, **more}
    kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "text/plain"
    return {"@id": name, "@type": "File", "name": name, "encodingFormat": kind, **more}


def write_crate(path: Path, root: Entity, parts: Sequence[Entity], others: Iterable[Entity]) -> None:
    """Write the metadata file of a crate, and replace an earlier one.

    Args:
        path: the file, named `NAME`, in the folder of the crate.
        root: name, description, datePublished, license and further properties of the crate.
        parts: files and folders of the crate.
        others: further entities; those of type CreateAction are mentioned by the root.
    """
    others = list(others)
    actions = [one["@id"] for one in others if one["@type"] == "CreateAction"]
    graph: list[Entity] = [
        {
            "@id": NAME,
            "@type": "CreativeWork",
            "about": {"@id": ROOT},
            "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
        },
        {
            "@id": ROOT,
            "@type": "Dataset",
            **root,
            "conformsTo": {"@id": PROFILE},
            "hasPart": refer(*(one["@id"] for one in parts)),
            "mentions": refer(*actions),
        },
        {"@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"},
        *parts,
        *others,
    ]
    with whole_file(path) as temporary:
        content = {"@context": _CONTEXT, "@graph": graph}
        temporary.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def describe_run(directory: Path | str) -> Path:
    """Write the metadata that make a run directory an RO-Crate; return the path of the file.

    InputError if the directory is no run, the run is still going on, or the file exists.
    """
    run = open_run(directory)
    folder, status = run.path, run.status
    if status.state == "running":
        raise InputError(f"{folder}: the run is going on; wait until it has ended")
    path = folder / NAME
    if path.exists():
        raise InputError(f"{path}: exists and is left as it is; delete it to write it anew")
    parts = [
        part(folder, one, **({} if one.is_dir() else {"contentSize": str(one.stat().st_size)}))
        for one in sorted(folder.iterdir())
        if one.name != LOCK and not is_partial(one.name)
    ]
    manifest = run.manifest
    versions = manifest.made_by
    programs = _software(versions.pop("smarticles", "unknown"), versions)
    made = [one["@id"] for one in parts if one["@id"] != SCENE]
    root = {
        "name": f"{manifest.name}, seed {manifest.seed}",
        "description": f"Run of `smarticles run`: {manifest.count} bodies, engine {manifest.engine}, fidelity "
        f"{manifest.fidelity}, scene {manifest.scene_sha256}; {MANIFEST} has all numbers",
        "datePublished": manifest.started,
        "license": _UNSTATED,
    }
    write_crate(path, root, parts, [*programs, _action(run, made)])
    return path


def _software(version: str, versions: Mapping[str, str]) -> list[Entity]:
    """Make the entities of this program and of the versions of what it ran with, by name; the program is the first."""
    with_it = [
        {"@id": f"#version-{name}", "@type": "PropertyValue", "name": name, "value": value}
        for name, value in versions.items()
    ]
    program = {
        "@id": _SMARTICLES,
        "@type": "SoftwareApplication",
        "name": "smarticles",
        "description": "Discrete-element simulation of entangled and active granular matter",
        "softwareVersion": version,
        "additionalProperty": refer(*(str(one["@id"]) for one in with_it)),
    }
    return [program, *with_it]


def _action(run: Run, made: Sequence[str]) -> Entity:
    status, started = run.status, run.manifest.started
    ended = {}
    if status.wall_s is not None:
        ended["endTime"] = (datetime.fromisoformat(started) + timedelta(seconds=round(status.wall_s))).isoformat()
    done = status.state == "done"
    return {
        "@id": "#run",
        "@type": "CreateAction",
        "name": f"smarticles run, scene {run.manifest.scene_sha256[:12]}",
        "description": run.manifest.command,
        "instrument": {"@id": _SMARTICLES},
        "object": refer(SCENE),
        "result": refer(*made),
        "startTime": started,
        **ended,
        "actionStatus": f"http://schema.org/{'Completed' if done else 'Failed'}ActionStatus",
        **({} if done else {"error": status.cause or status.state}),
    }
