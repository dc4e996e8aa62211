"""render: a picture or a film of a run, or of several beside each other."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from dem.errors import InputError
from smarticles.command_line import Commands, add_shared, positive_number, reader

_PICTURE_SUFFIX = ".png"
_FILM_SUFFIXES = (".gif", ".webp", ".mp4")
# Options of one kind alone, by their names in the parsed arguments: of films, and of pictures.
_OF_FILMS = {"fps": "--fps", "start": "--from", "end": "--to", "every": "--every"}
_OF_PICTURES = {"time": "--time", "smarticle": "--smarticle"}


def _ends(text: str) -> tuple[float, float] | str:
    low, _, high = text.partition(":")
    return text if text == "run" else (float(low), float(high))


def _sides(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height or width)


_limits = reader(
    _ends,
    "LOW:HIGH, two numbers in order, or run",
    lambda ends: isinstance(ends, str) or -math.inf < ends[0] < ends[1] < math.inf,
)
_size = reader(_sides, "a number of pixels from 1, or two as in 1280x720", lambda sides: min(sides) >= 1)


def add(commands: Commands) -> None:
    """Add the command."""
    render = commands.add(
        "render",
        render_run,
        summary="draw a picture or a film of a run",
        text="""
Draws the true boxes of all smarticles in a cylinder that is cut open in front, with hooks, strings and a
bar for the scale. Needs no display. The end of the output's name decides: .png is a picture; .gif, .webp
and .mp4 are films, which play at one speed and show it.""",
        examples="""\
  smarticles render runs/a                                   last frame, runs/a/render.png
  smarticles render runs/a --time 1.5 --color-by speed --output shaken.png
  smarticles render runs/a --output film.mp4 --from 1 --to 3 --fps 25
  smarticles render runs/a --compare runs/b --output both.png
  smarticles render runs/a --forces --output chains.png
  smarticles render runs/a --smarticle 17 --output hooked.png
""",
    )
    render.add_argument("directory", type=Path, metavar="DIR", help="run directory")
    render.add_argument("--output", type=Path, metavar="FILE", help="default: DIR/render.png")
    render.add_argument(
        "--compare",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="draw these runs beside it, at the same time, of the same size, in the same colours",
    )
    render.add_argument("--time", type=float, metavar="S", help="simulated time of a picture [s]; default: end")
    render.add_argument(
        "--color-by",
        metavar="WHAT",
        help="crossings (default; links of others through its plane), contacts, height, speed, id (default of motion "
        "in a plane)",
    )
    render.add_argument(
        "--clim",
        type=_limits,
        metavar="LOW:HIGH",
        help="ends of the scale of colours, or run: those of all frames of the run; default: of what is shown",
    )
    render.add_argument(
        "--forces",
        action="store_true",
        help="draw a line through each contact, as thick as its normal force is large, where the run records forces",
    )
    render.add_argument("--view", metavar="VIEW", help="front (default; of motion in a plane: top), oblique, top")
    render.add_argument(
        "--smarticle", type=int, metavar="ID", help="only this one and those that pass through its plane"
    )
    render.add_argument(
        "--size",
        type=_size,
        metavar="PIXELS",
        help="width and height, or WIDTHxHEIGHT, of the picture of one run; default: 1200, of a film 720",
    )
    render.add_argument("--fps", type=positive_number, metavar="N", help="pictures per second of a film; default: 15")
    render.add_argument("--from", dest="start", type=float, metavar="S", help="simulated time a film begins at [s]")
    render.add_argument("--to", dest="end", type=float, metavar="S", help="simulated time a film ends at [s]")
    render.add_argument(
        "--every",
        type=positive_number,
        metavar="S",
        help="simulated time from one picture of a film to the next [s]; default: every frame, of many some 150",
    )
    add_shared(render, "--overwrite")


def render_run(arguments: argparse.Namespace) -> int:
    """Draw a picture or a film."""
    output: Path | None = arguments.output
    film = output is not None and output.suffix in _FILM_SUFFIXES
    if output is not None and not film and output.suffix != _PICTURE_SUFFIX:
        kinds = f"{_PICTURE_SUFFIX} for a picture, {', '.join(_FILM_SUFFIXES)} for a film"
        msg = f"--output {output}: {output.suffix!r} is no kind of file that is drawn here; end the name in {kinds}"
        raise InputError(msg)
    for name, option in (_OF_PICTURES if film else _OF_FILMS).items():
        value = getattr(arguments, name)
        if value is not None:
            way_out = "a picture shows one time; use --time, or write a film: --output film.gif"
            if film:
                why = "a film shows all times" if name == "time" else "is drawn alone, in a picture"
                way_out = f"{why}; leave it out, or write .png"
            raise InputError(f"{option} {value:g}: {way_out}")
    from postprocess.pictures import render  # noqa: PLC0415  (imports PyVista)

    options: dict[str, Any] = {
        "color_by": arguments.color_by,
        "view": arguments.view,
        "limits": arguments.clim,
        "compare": arguments.compare,
        "forces": arguments.forces,
        "overwrite": arguments.overwrite,
        **({"size": arguments.size} if arguments.size else {}),
        **({"frames_per_second": arguments.fps} if arguments.fps else {}),
    }
    if film:
        track = _track if sys.stderr.isatty() else None
        span = {"start": arguments.start, "end": arguments.end, "every": arguments.every}
        print(render.render_film(arguments.directory, output, track=track, **span, **options))
    else:
        one = {"time": arguments.time, "smarticle": arguments.smarticle}
        print(render.render_run(arguments.directory, output=output, **one, **options))
    return 0


def _track(images: Iterable[Any], count: int) -> Iterable[Any]:
    """Show a bar on the terminal until the film is done."""
    from rich.console import Console  # noqa: PLC0415  (costs a tenth of a second)
    from rich.progress import track  # noqa: PLC0415

    return track(images, "drawing", total=count, console=Console(stderr=True), transient=True)
