"""Commands `init` and `schema`: write a commented example scene; print the JSON schema of scenes."""

import argparse
import json
import shlex
from pathlib import Path

from dem.errors import InputError
from smarticles.command_line import Commands, add_options
from smarticles.starters import KINDS, about, starter


def add(commands: Commands) -> None:
    """Add `init` and `schema` to the command line."""
    init = commands.add(
        "init",
        write_scene,
        summary="write a commented example scene",
        text="Each scene takes seconds to compute, and explains the keys. An existing file is never replaced.\n\n"
        + "\n".join(f"  {kind:<10}{about(kind)}" for kind in KINDS),
        examples="""\
  smarticles init                                 scene.yaml: pour, rest, shake
  smarticles init actuated --output gait.yaml     smarticles that move
""",
    )
    init.add_argument(
        "kind", nargs="?", choices=KINDS, default=KINDS[0], metavar="KIND", help=f"{', '.join(KINDS)}; default: shaken"
    )
    add_options(init, "--output", default=Path("scene.yaml"), metavar="FILE.yaml", help="default: scene.yaml")
    commands.add(
        "schema",
        print_schema,
        summary="print the JSON schema of scene files",
        text="""
The schema has every key with unit, default and meaning. Editors complete and check a scene with it if
the first line of the scene is `# yaml-language-server: $schema=scene.schema.json`.""",
        examples="""\
  smarticles schema > scene.schema.json
""",
    )


def write_scene(arguments: argparse.Namespace) -> int:
    """Write an example scene to a new file; return the exit status."""
    output: Path = arguments.output
    try:
        # Mode "x" fails for existing files and links.
        with output.open("x", encoding="utf-8") as file:
            file.write(starter(arguments.kind))
    except FileExistsError:
        raise InputError(f"--output {output}: exists; choose another name") from None
    except FileNotFoundError:
        msg = f"--output {output}: the folder {output.parent} does not exist; make it, or choose another one"
        raise InputError(msg) from None
    scene, run = shlex.quote(str(output)), shlex.quote(f"runs/{output.stem}")
    print(f"{output}: {about(arguments.kind)}")
    print(f"next: smarticles plan {scene}, smarticles run {scene} --out {run}")
    return 0


def print_schema(_: argparse.Namespace) -> int:
    """Print the JSON schema of scenes; return the exit status."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    print(json.dumps(json_schema(), indent=2, ensure_ascii=False))
    return 0
