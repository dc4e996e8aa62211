"""schema: the JSON schema of scene files."""

from __future__ import annotations

import argparse
import json

from smarticles.parsing import Commands


def add(commands: Commands) -> None:
    """Add the command."""
    commands.add(
        "schema",
        print_schema,
        summary="print the JSON schema of scene files",
        text="""
Every key with its unit, default and meaning. Editors use it to complete and check scenes: put
`# yaml-language-server: $schema=scene.schema.json` on the first line of a scene.""",
        examples="""\
  smarticles schema > scene.schema.json
""",
    )


def print_schema(_: argparse.Namespace) -> int:
    """`smarticles schema`."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    print(json.dumps(json_schema(), indent=2, ensure_ascii=False))
    return 0
