"""Commands `init`, `keys` and `schema`: write an example scene; print the keys of scenes."""

import argparse
import json
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any

from dem.errors import InputError, nearest
from dem.terminal import say, text_width
from smarticles.command_line import Commands, add_options, as_json
from smarticles.starters import KINDS, about, starter


def add(commands: Commands) -> None:
    """Add `init`, `keys` and `schema` to the command line."""
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
    keys = commands.add(
        "keys",
        print_keys,
        summary="print the keys of scenes with default, range and meaning",
        text="NAME is a key with keys of its own, or a type of phase or motion. Without NAME the keys of the scene.",
        examples="""\
  smarticles keys
  smarticles keys motor
  smarticles keys shake
""",
    )
    keys.add_argument("name", nargs="?", metavar="NAME", help="a part of the scene; without it the scene itself")
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
    say(f"{output}: {about(arguments.kind)}")
    print(f"next: smarticles plan {scene}, smarticles run {scene} --out {run}")
    return 0


def print_keys(arguments: argparse.Namespace) -> int:
    """Print the keys of a part of scenes; return the exit status."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    schema = json_schema()
    parts = list(_parts(schema))
    known = list(dict.fromkeys(name for name, _ in parts))
    if arguments.name is None:
        print(
            *_described(schema),
            "",
            *wrap(f"more, by `smarticles keys NAME`: {', '.join(known)}", text_width(), break_on_hyphens=False),
            sep="\n",
        )
        return 0
    if arguments.name not in known:
        if arguments.name in schema["properties"]:
            raise InputError(f"keys {arguments.name}: has no keys of its own; `smarticles keys` describes it")
        owners = [name for name, definition in parts if arguments.name in definition.get("properties", {})]
        if owners:
            of = " and ".join(dict.fromkeys(owners))
            raise InputError(f"keys {arguments.name}: is a key of {of}; see `smarticles keys {owners[0]}`")
        raise InputError(f"keys {arguments.name}: is no part of a scene; {nearest(arguments.name, known)}")
    # Several parts may have one name: `motor` is a key of scenes, and a law of joints.
    found = [definition for name, definition in parts if name == arguments.name]
    for number, definition in enumerate(found):
        if definition not in found[:number]:
            print(*([""] if number else []), *_described(definition), sep="\n")
    return 0


def _parts(schema: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the name and the JSON schema of each part of a scene, that is, of each mapping inside a scene.

    A part is named by its key, such as `container`. If a key allows several types of mappings, as `phases` does, the
    part of this name only lists the types, and each type, such as `deposit`, is a part of its own.
    """
    definitions = schema["$defs"]
    for definition in (schema, *definitions.values()):
        for key, entry in definition["properties"].items():
            found = [option["$ref"] for option in entry.get("anyOf", [entry]) if "$ref" in option]
            if len(found) == 1:
                yield key, definitions[found[0].rpartition("/")[2]]
            elif kinds := _kinds(entry):
                about = f"{entry.get('description', key)}. Each is one of: {', '.join(kinds)}"
                yield key, {"description": about, "properties": {}}
    for definition in definitions.values():
        for entry in definition["properties"].values():
            if "const" in entry and isinstance(entry["const"], str):
                yield entry["const"], definition


def _kinds(entry: Mapping[str, Any]) -> list[str]:
    """Return the types of mappings, such as `deposit`, that a key of a scene allows; empty if none.

    `entry` is the entry of the key in the JSON schema.
    """
    if "discriminator" in entry:
        return list(entry["discriminator"]["mapping"])
    options = [*entry.get("anyOf", ()), *([entry["items"]] if "items" in entry else [])]
    return next(filter(None, map(_kinds, options)), [])


def _described(definition: Mapping[str, Any]) -> Iterator[str]:
    """Yield lines of text about a part: its description; default, choices, range and meaning of its keys."""
    yield from wrap(definition.get("description", ""), text_width())
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    for key, entry in definition["properties"].items():
        options = entry.get("anyOf", [entry])
        facts = [f"{sign} {option[word]:g}" for option in options for word, sign in signs.items() if word in option]
        facts += [" or ".join(map(str, option["enum"])) for option in options if "enum" in option]
        if key in definition.get("required", ()):
            facts.insert(0, "needed")
        elif "default" in entry:
            facts.insert(0, f"default {json.dumps(entry['default'], ensure_ascii=False)}")
        value = f": {entry['const']}" if "const" in entry else ""
        yield f"  {key}{value}" + (f"    {', '.join(facts)}" if facts and not value else "")
        yield from wrap(entry.get("description", ""), text_width(), initial_indent=" " * 6, subsequent_indent=" " * 6)


def print_schema(_: argparse.Namespace) -> int:
    """Print the JSON schema of scenes; return the exit status."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    print(as_json(json_schema()))
    return 0
