"""Command `render`: draw a picture or a film of one run, or of several runs side by side."""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from dem.display import progress_of
from dem.errors import InputError
from smarticles.command_line import Commands, add_options, names, positive_number, reader

_PICTURE_SUFFIX = ".png"
_CHART_SUFFIXES = (".png", ".pdf", ".svg")
_FILM_SUFFIXES = (".gif", ".webp", ".mp4")
# Options that only films or only pictures accept, by their names in the parsed arguments.
_OF_FILMS = {"fps": "--fps", "start": "--from", "end": "--to", "every": "--every"}
_OF_PICTURES = {"time": "--time", "smarticle": "--smarticle"}
_OF_BODIES = {"color_by": "--color-by", "clim": "--clim", "view": "--view", "size": "--size"}


def _limits_of(text: str) -> tuple[float, float] | str:
    low, _, high = text.partition(":")
    return text if text == "run" else (float(low), float(high))


def _size_of(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height or width)


_limits = reader(
    _limits_of,
    "LOW:HIGH, two numbers in order, or run",
    lambda ends: isinstance(ends, str) or -math.inf < ends[0] < ends[1] < math.inf,
)
_size = reader(_size_of, "a number of pixels from 1, or two as in 1280x720", lambda sides: min(sides) >= 1)


def add(commands: Commands) -> None:
    """Add `render` to the command line."""
    render = commands.add(
        "render",
        render_run,
        summary="draw a picture, a film or a chart of a run",
        text="""
Draws all bodies by their true sections, the cylinder cut open in front, hooks, plate, strings and a
scale bar. No display is needed. The suffix of the output chooses between a picture (.png) and a film (.gif,
.webp, .mp4). A film plays at a constant speed, which is written on it. Names of kinds are in a legend.
With --series, draws recorded series against time instead, with phases as bands.""",
        examples="""\
  smarticles render runs/a                                   last frame, runs/a/render.png
  smarticles render runs/a --time 1.5 --color-by speed --output shaken.png
  smarticles render runs/a --output film.mp4 --from 1 --to 3 --fps 25
  smarticles render runs/a --compare runs/b --output both.png
  smarticles render runs/a --forces --output chains.png
  smarticles render runs/a --smarticle 17 --output hooked.png
  smarticles render runs/a --series com_height_m,kinetic_energy_J --output height.pdf
""",
    )
    add_options(render, "directory")
    add_options(render, "--output", help="default: DIR/render.png")
    render.add_argument(
        "--compare",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="draw these runs next to DIR, at equal time and size, with one colour scale",
    )
    add_options(render, "--time", help="simulated time of a picture [s]; default: end")
    add_options(
        render,
        "--color-by",
        help="crossings (default; number of links of others through the smarticle's plane), contacts, height, speed, "
        "id (default for motion in a plane), entry (of the scene's list particle; default for mixtures), or another "
        "field of `smarticles export`, such as local_packing_fraction",
    )
    render.add_argument(
        "--clim",
        type=_limits,
        metavar="LOW:HIGH",
        help="limits of the colour scale; run: limits over all frames of the run; default: limits of the shown frames",
    )
    render.add_argument(
        "--forces",
        action="store_true",
        help="draw a line through each contact, of a thickness proportional to its normal force; needs "
        "recording.contact_forces",
    )
    render.add_argument("--view", metavar="VIEW", help="front (default), oblique, top (default for motion in a plane)")
    render.add_argument(
        "--smarticle", type=int, metavar="ID", help="draw only this smarticle and those that pass through its plane"
    )
    render.add_argument(
        "--size",
        type=_size,
        metavar="PIXELS",
        help="side of the square picture of one run, or WIDTHxHEIGHT; default: 1200, for films 720",
    )
    render.add_argument("--fps", type=positive_number, metavar="N", help="pictures per second of a film; default: 15")
    render.add_argument(
        "--from", dest="start", type=float, metavar="S", help="simulated time at the start of a film [s]"
    )
    render.add_argument("--to", dest="end", type=float, metavar="S", help="simulated time at the end of a film [s]")
    render.add_argument(
        "--every",
        type=positive_number,
        metavar="S",
        help="simulated time between two pictures of a film [s]; default: every frame, at most about 150 pictures",
    )
    render.add_argument(
        "--series",
        type=names,
        metavar="NAME,…",
        help="draw these recorded series against time instead of bodies, such as com_height_m, into a .png, .pdf or "
        ".svg; default: DIR/NAME.png",
    )
    add_options(render, "--overwrite")


def render_run(arguments: argparse.Namespace) -> int:
    """Draw a picture, a film or a chart; return the exit status."""
    output: Path | None = arguments.output
    if arguments.series is not None:
        return _chart(arguments)
    film = output is not None and output.suffix in _FILM_SUFFIXES
    if output is not None and not film and output.suffix != _PICTURE_SUFFIX:
        kinds = f"{_PICTURE_SUFFIX} for a picture, {', '.join(_FILM_SUFFIXES)} for a film"
        if output.suffix in _CHART_SUFFIXES:
            kinds += f"; bodies are drawn in pixels (--size 4000), and {output.suffix} is for charts (--series)"
        msg = f"--output {output}: {output.suffix!r} is no supported format; end the name in {kinds}"
        raise InputError(msg)
    for name, option in (_OF_PICTURES if film else _OF_FILMS).items():
        value = getattr(arguments, name)
        if value is not None:
            way_out = "a picture shows one time; use --time, or write a film: --output film.gif"
            if film:
                why = "a film shows all times" if name == "time" else "a single smarticle is drawn in pictures only"
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
        span = {"start": arguments.start, "end": arguments.end, "every": arguments.every}
        print(render.render_film(arguments.directory, output, track=_track, **span, **options))
    else:
        selection = {"time": arguments.time, "smarticle": arguments.smarticle}
        with progress_of("drawing"):
            written = render.render_run(arguments.directory, output=output, **selection, **options)
        print(written)
    return 0


def _chart(arguments: argparse.Namespace) -> int:
    """Draw recorded series against time; return the exit status."""
    for name, option in (_OF_FILMS | _OF_PICTURES | _OF_BODIES).items():
        if getattr(arguments, name) is not None:
            raise InputError(f"{option}: is for pictures of bodies, and --series draws a chart; leave one of them out")
    for name in ("compare", "forces"):
        if getattr(arguments, name):
            raise InputError(f"--{name}: is for pictures of bodies, and --series draws a chart; leave one of them out")
    from postprocess.report.series import write_series  # noqa: PLC0415  (imports Matplotlib)

    options = {"output": arguments.output, "overwrite": arguments.overwrite}
    print(write_series(arguments.directory, arguments.series, **options))
    return 0


def _track(images: Iterable[Any], count: int) -> Iterable[Any]:
    """Show the progress while the images of a film are drawn."""
    with progress_of("drawing") as progress:
        for number, image in enumerate(images, start=1):
            yield image
            progress("pictures drawn", number, count)
