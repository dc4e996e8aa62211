"""The console command `smarticles`: command line in, exit status out.

Exit status: 0 done; 1 the run failed; 2 bad input or usage; 75 stopped at a checkpoint as SIGUSR1 asked, to be
continued; 130 stopped by Ctrl-C.
"""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from collections.abc import Callable, Sequence

from dem.errors import InputError, RunError
from smarticles.commands import (
    accuracy,
    compare,
    doctor,
    export,
    measure,
    plan,
    render,
    report,
    resume,
    run,
    scene_files,
    status,
    study,
    sweep,
    view,
)
from smarticles.completion import add_completion
from smarticles.parsing import Commands, Parser, add_debug
from smarticles.stopping import orderly_stop

COMMANDS = (
    *(scene_files, run, plan, doctor, measure, compare, render, view, export, report),
    *(sweep, status, resume, study, accuracy),
)
"""In the order of `smarticles --help`; a new command is a module of `smarticles.commands` and a word here."""

FAILED, BAD_INPUT, STOPPED, BROKEN_PIPE = 1, 2, 130, 141

_DESCRIPTION = """\
Discrete-element simulation of smarticles: U-shaped particles, poured, shaken, measured.

A scene (YAML) is run into a run directory; measures, tables and pictures come from its files."""

_EPILOG = """\
first steps:
  smarticles doctor                        what is installed, and does it work
  smarticles study gravish --quick --out demo
                                           pour, shake, measure, compare with Gravish: minutes
  smarticles init                          scene.yaml, small and commented
  smarticles plan scene.yaml               what a run would do and cost
  smarticles run scene.yaml --out run1     do it

completion of commands and options: eval "$(smarticles --completion bash)" in ~/.bashrc; for zsh put
what --completion zsh prints into a file _smarticles in a folder of $fpath

exit status: 0 done; 1 the run failed; 2 bad input or usage; 75 stopped at a checkpoint by SIGUSR1,
to be continued; 130 stopped by Ctrl-C"""


def build_parser() -> tuple[Parser, Commands]:
    """The parser of the whole command, and its subcommands."""
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415  (slow to import)

    try:
        release = version("smarticles")
    except PackageNotFoundError:
        release = "not installed"
    parser = Parser(prog="smarticles", description=_DESCRIPTION, epilog=_EPILOG)
    parser.add_argument("--version", action="version", version=f"smarticles {release}")
    add_completion(parser)
    add_debug(parser)
    commands = Commands(parser)
    for module in COMMANDS:
        module.add(commands)
    return parser, commands


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: the arguments; by default those of this process.

    Returns:
        The exit status.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    return guarded(lambda: _dispatch(words), debug="--debug" in words)


def guarded(action: Callable[[], int], *, debug: bool = False) -> int:
    """The one place where what ends an action becomes a message and an exit status.

    Args:
        action: what to do; returns its exit status.
        debug: whether to show the traceback of an error.
    """
    try:
        with orderly_stop():
            status = action()
            sys.stdout.flush()
            return status
    except SystemExit as error:  # argparse, after --help and --version
        return error.code if isinstance(error.code, int) else 0
    except BrokenPipeError:
        # Who read our output, such as `head`, has had enough: nothing more must be flushed to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except KeyboardInterrupt as error:
        _complain(f"stopped; {str(error) or 'what was written is whole'}", error, debug)
        return STOPPED
    except Exception as error:  # nothing passes without a message
        return _report(error, debug)


def _dispatch(words: list[str]) -> int:
    parser, commands = build_parser()
    arguments, unknown = parser.parse_known_args(words)
    if arguments.command is None:
        if unknown:
            parser.refuse_unknown(unknown)
        parser.error(f"no command given; known: {', '.join(commands.parsers)}")
    if unknown:
        commands.parsers[arguments.command].refuse_unknown(unknown)
    arguments.command_line = shlex.join(["smarticles", *words])
    status: int = arguments.handler(arguments)
    return status


def _report(error: Exception, debug: bool) -> int:
    if isinstance(error, InputError):
        _complain(f"error: {error}", error, debug)
        return BAD_INPUT
    if isinstance(error, RunError):
        text = str(error)
    elif isinstance(error, ModuleNotFoundError):
        text = f"the Python package {error.name!r} is not installed; run `make setup`, then `smarticles doctor`"
    elif isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        text = f"{where}{error.strerror or error}; free space, or check the path and its permissions"
    else:
        text = (
            f"internal error, {type(error).__name__}: {error}; "
            "please report it with the output of the same command with --debug"
        )
    _complain(f"error: {text}", error, debug)
    return FAILED


def _complain(text: str, error: BaseException, debug: bool) -> None:
    print(f"smarticles: {' '.join(text.split())}", file=sys.stderr)
    if debug:
        traceback.print_exception(error)
