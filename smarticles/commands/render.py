"""render: a picture or a film of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from dem.errors import InputError
from smarticles.parsing import Commands, add_overwrite, positive_int

_PICTURE_SUFFIX = ".png"
_FILM_SUFFIXES = (".gif", ".webp", ".mp4")


def add(commands: Commands) -> None:
    """Add the command."""
    render = commands.add(
        "render",
        render_run,
        summary="draw a picture or a film of a run",
        text="""
Draws the true boxes of all smarticles in a cylinder that is cut open in front. Needs no display.
The end of the output's name decides: .png is a picture; .gif, .webp and .mp4 are films.""",
        examples="""\
  smarticles render runs/a                                   last frame, runs/a/render.png
  smarticles render runs/a --time 1.5 --color-by speed --output shaken.png
  smarticles render runs/a --output film.gif
""",
    )
    render.add_argument("directory", type=Path, metavar="DIR", help="run directory")
    render.add_argument("--output", type=Path, metavar="FILE", help="default: DIR/render.png")
    render.add_argument("--time", type=float, metavar="S", help="simulated time [s]; default: end")
    render.add_argument(
        "--color-by",
        metavar="WHAT",
        help="crossings (default; links of others through its plane), contacts, height, speed, id (default of motion "
        "in a plane)",
    )
    render.add_argument("--view", metavar="VIEW", help="front (default; of motion in a plane: top), oblique, top")
    render.add_argument(
        "--size", type=positive_int, metavar="PIXELS", help="width and height; default: 1200, of a film 720"
    )
    add_overwrite(render)


def render_run(arguments: argparse.Namespace) -> int:
    """`smarticles render`."""
    output: Path | None = arguments.output
    film = output is not None and output.suffix in _FILM_SUFFIXES
    if output is not None and not film and output.suffix != _PICTURE_SUFFIX:
        kinds = f"{_PICTURE_SUFFIX} for a picture, {', '.join(_FILM_SUFFIXES)} for a film"
        msg = f"--output {output}: {output.suffix!r} is no kind of file that is drawn here; end the name in {kinds}"
        raise InputError(msg)
    if film and arguments.time is not None:
        msg = f"--time {arguments.time:g}: a film shows all times; leave it out, or write .png"
        raise InputError(msg)
    from postprocess.pictures import render  # noqa: PLC0415  (imports PyVista)

    look: dict[str, Any] = {"color_by": arguments.color_by, "view": arguments.view}
    if arguments.size is not None:
        look["size"] = (arguments.size, arguments.size)
    if film:
        written = render.render_film(arguments.directory, output, overwrite=arguments.overwrite, **look)
    else:
        written = render.render_run(
            arguments.directory,
            output=output,
            time=arguments.time,
            overwrite=arguments.overwrite,
            **look,
        )
    print(written)
    return 0
