"""init and schema: a commented scene to begin with, and all keys that a scene may have."""

from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path

from dem.errors import InputError
from smarticles.command_line import Commands
from smarticles.starters import KINDS, about, starter


def add(commands: Commands) -> None:
    """Add `init` and `schema`."""
    init = commands.add(
        "init",
        write_scene,
        summary="write a commented scene to begin with",
        text="Small scenes, seconds each, with a word on every key worth changing. Nothing is overwritten.\n\n"
        + "\n".join(f"  {kind:<10}{about(kind)}" for kind in KINDS),
        examples="""\
  smarticles init                                 scene.yaml: pour, rest, shake
  smarticles init actuated --output gait.yaml     smarticles that move
""",
    )
    init.add_argument(
        "kind", nargs="?", choices=KINDS, default=KINDS[0], metavar="KIND", help=f"{', '.join(KINDS)}; default: shaken"
    )
    init.add_argument(
        "--output", type=Path, default=Path("scene.yaml"), metavar="FILE.yaml", help="default: scene.yaml"
    )
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


def write_scene(arguments: argparse.Namespace) -> int:
    """`smarticles init`."""
    output: Path = arguments.output
    try:
        # "x": never over a file that exists, nor through a link.
        with output.open("x", encoding="utf-8") as file:
            file.write(starter(arguments.kind))
    except FileExistsError:
        raise InputError(f"--output {output}: exists; choose another name") from None
    except FileNotFoundError:
        msg = f"--output {output}: the folder {output.parent} does not exist; make it, or choose another one"
        raise InputError(msg) from None
    place, run = shlex.quote(str(output)), shlex.quote(f"runs/{output.stem}")
    print(f"{output}: {about(arguments.kind)}")
    print(f"next: smarticles plan {place}, smarticles run {place} --out {run}")
    return 0


def print_schema(_: argparse.Namespace) -> int:
    """`smarticles schema`."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    print(json.dumps(json_schema(), indent=2, ensure_ascii=False))
    return 0
