"""Names that would do something where text is taken for code, and runs and sweeps that carry them."""

from __future__ import annotations

import json
from pathlib import Path

from dem.scene.reading import dump_scene, parse_scene
from templates.sweep.folder import Entry

NAMES = (
    "<script>document.body.dataset.hit = 1</script>",
    '"><img src=x onerror="document.body.dataset.hit=1">',
    "</style></title><h1 id=hit>",
    "{{ 7 * 7 }} {% for x in y %}",
    "javascript:alert(1)",
    "$\\frac{1}{",
    "a" * 100,
)


def spoil(run: Path, name: str) -> Path:
    """Puts a hostile name wherever a run directory has one: scene, manifest, cause, log, versions, command."""
    scene = parse_scene(
        {
            "schema_version": 1, "name": name[:100], "seed": 1, "count": 12, "engine": "links",
            "phases": [{"type": "deposit"}, {"type": "relax"}, {"type": "shake"}, {"type": "relax"}],
        },
        source="here",
    )  # fmt: skip
    (run / "scene.yaml").write_text(dump_scene(scene), encoding="utf-8")
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
    manifest |= {"name": name, "command": f"smarticles run {name}"}
    manifest["versions"]["git"] = name
    (run / "run.json").write_text(json.dumps(manifest), encoding="utf-8")
    (run / "log.txt").write_text(f"2026-11-22 07:00:00,000 WARNING beware of {name}\n", encoding="utf-8")
    if (run / "failed.json").exists():
        failed = json.loads((run / "failed.json").read_text(encoding="utf-8"))
        (run / "failed.json").write_text(json.dumps(failed | {"cause": name}), encoding="utf-8")
    return run


def of_entry(run: Path, entry: Entry) -> Path:
    """Makes a made-up run the one that a sweep lists: by the hash of its scene, and its engine."""
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
    manifest |= {"scene_sha256": entry.scene_sha256, "engine": entry.values.get("engine", "yade")}
    (run / "run.json").write_text(json.dumps(manifest), encoding="utf-8")
    return run
