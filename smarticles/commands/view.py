"""view: a run in a page of the browser."""

from __future__ import annotations

import argparse
import os
import sys
import webbrowser
from pathlib import Path

from smarticles.command_line import Commands, reader

_port = reader(int, "a whole number from 0 to 65535", lambda number: 0 <= number <= 65535)


def add(commands: Commands) -> None:
    """Add the command."""
    view = commands.add(
        "view",
        view_run,
        summary="look around in a run, in a page of the browser",
        text="""
Serves a page on this machine alone, at an address that is printed: it holds a token. Turn
with the mouse, move in time, colour by any field of `smarticles export --help`, click on a smarticle
for its fields. A run that goes on is followed. Ends with its window, or by Ctrl-C. Needs no network.""",
        examples="""\
  smarticles view runs/a
  smarticles view runs/a --no-browser --port 8000      on a cluster: then ssh -L 8000:127.0.0.1:8000
""",
    )
    view.add_argument("directory", type=Path, metavar="DIR", help="run directory")
    view.add_argument("--port", type=_port, default=0, metavar="N", help="to listen on; default: any that is free")
    view.add_argument("--no-browser", action="store_true", help="print the address, and open nothing")


def view_run(arguments: argparse.Namespace) -> int:
    """Serve the page until its window closes."""
    import trame  # noqa: F401, PLC0415  (first, since its extra brings PyVista along)

    from postprocess.view import view_run as serve  # noqa: PLC0415  (imports PyVista and the server)

    def opened(address: str) -> None:
        print(address, flush=True)
        print("close its window, or press Ctrl-C, to end", file=sys.stderr, flush=True)
        windows = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        if windows and not arguments.no_browser:
            webbrowser.open(address)

    try:
        serve(arguments.directory, port=arguments.port, opened=opened)
    except KeyboardInterrupt:
        return 0
    return 0
