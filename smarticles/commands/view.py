"""Command `view`: serve an interactive view of a run to the browser."""

import argparse
import os
import sys
import webbrowser
from contextlib import suppress

from smarticles.command_line import Commands, add_options, reader

_port = reader(int, "a whole number from 0 to 65535", lambda number: 0 <= number <= 65535)


def add(commands: Commands) -> None:
    """Add `view` to the command line."""
    view = commands.add(
        "view",
        view_run,
        summary="show a run in the browser, interactively",
        text="""
Serves a page to browsers on this machine, at the printed address, which contains a secret token. Turn
the view with the mouse, move in time, colour by any field of `smarticles export --help`, click on a
smarticle to see its fields. New frames of an unfinished run appear. Close the page or press Ctrl-C to
end. No network is needed.""",
        examples="""\
  smarticles view runs/a
  smarticles view runs/a --no-browser --port 8000      on a cluster: then ssh -L 8000:127.0.0.1:8000
""",
    )
    add_options(view, "directory")
    view.add_argument("--port", type=_port, default=0, metavar="N", help="port to listen on; default: any free port")
    view.add_argument("--no-browser", action="store_true", help="print the address without opening a browser")


def view_run(arguments: argparse.Namespace) -> int:
    """Serve the page until it is closed; return the exit status."""
    import trame  # noqa: F401, PLC0415  (first: if it is missing, the error names the extra that brings PyVista too)

    from postprocess.view import view_run as serve  # noqa: PLC0415  (imports PyVista and the server)

    def opened(address: str) -> None:
        print(address, flush=True)
        print("close the page or press Ctrl-C to end", file=sys.stderr, flush=True)
        has_display = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        if has_display and not arguments.no_browser:
            webbrowser.open(address)

    with suppress(KeyboardInterrupt):
        serve(arguments.directory, port=arguments.port, opened=opened)
    return 0
