"""Define the console command `smarticles`; its help lists the exit statuses."""

import argparse
import logging
import os
import shlex
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

from dem.errors import InputError, RunError
from dem.run.stop import release
from dem.terminal import complain, printable
from smarticles.command_line import Commands, Parser, add_options
from smarticles.commands import (
    accuracy,
    calibrate,
    compare,
    doctor,
    export,
    measure,
    plan,
    render,
    report,
    run,
    scene_files,
    status,
    study,
    sweep,
    view,
)

COMMANDS = (
    *(scene_files.add, run.add, plan.add, doctor.add, measure.add, compare.add, render.add, view.add, export.add),
    *(report.add, sweep.add, status.add, run.add_resume, study.add, accuracy.add),
    calibrate.add,
)
"""Functions that add the commands, in the order of `smarticles --help`; add a new command here."""

FAILED, BAD_INPUT, STOPPED, BROKEN_PIPE = 1, 2, 130, 141  #: Exit statuses; 141: the output's reader closed it

_SHELLS = ("bash", "zsh")
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
AGAIN_S = 0.02  # after which an interrupt that was dropped is raised again [s]: later than the end of what dropped it

_DESCRIPTION = """\
Discrete-element simulation of smarticles, U-shaped particles of three links.

A scene (YAML) describes a simulation. `run` records the simulation in a run directory; the other commands
measure, draw and compare run directories."""

_EPILOG = """\
first steps:
  smarticles doctor                        test the installation
  smarticles init                          write a small commented scene.yaml
  smarticles plan scene.yaml               print phases, effects, expected wall time
  smarticles run scene.yaml --out run1     compute
  smarticles render run1                   draw the last frame

completion of commands and options: add eval "$(smarticles --completion bash)" to ~/.bashrc; for zsh,
write the output of --completion zsh to a file _smarticles in a folder of $fpath

exit status: 0 done; 1 the run failed; 2 bad input or usage; 75 stopped at a checkpoint by SIGUSR1,
to be continued; 130 stopped by Ctrl-C"""


def build_parser() -> tuple[Parser, Commands]:
    """Return the parser of `smarticles`, and its subcommands."""
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415  (slow to import)

    try:
        release = version("smarticles")
    except PackageNotFoundError:
        release = "not installed"
    parser = Parser(prog="smarticles", description=_DESCRIPTION, epilog=_EPILOG)
    parser.add_argument("--version", action="version", version=f"smarticles {release}")
    parser.add_argument(
        "--completion",
        choices=_SHELLS,
        action=_PrintCompletion,
        metavar="SHELL",
        help=f"print the completion script of a shell ({', '.join(_SHELLS)}) and exit",
    )
    add_options(parser, "--debug")
    commands = Commands(parser)
    for add in COMMANDS:
        add(commands)
    return parser, commands


class _PrintCompletion(argparse.Action):
    """Print the completion script of a shell; arguments of type Path complete to files or directories."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        import shtab  # noqa: PLC0415  (needed here alone)

        parsers = [parser]
        for current in parsers:
            for action in current._actions:
                if isinstance(action, argparse._SubParsersAction):
                    parsers += action.choices.values()
                elif action.type is Path:
                    kind = shtab.DIRECTORY if "DIR" in str(action.metavar) else shtab.FILE
                    action.complete = kind  # type: ignore[attr-defined]
        print(shtab.complete(parser, str(values)))
        parser.exit(0)


def main(argv: Sequence[str] | None = None) -> int:
    """Run `smarticles` with the given arguments, by default those of this process; return the exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    # It logs advice about its folders where there is no home directory.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    with printable():
        return guarded(lambda: _dispatch(words), debug="--debug" in words)


def guarded(action: Callable[[], int], *, debug: bool = False) -> int:
    """Run an action and return the exit status; print the cause of a failure or an interruption on stderr.

    `debug`: print tracebacks, too.
    """
    try:
        with orderly_stop():
            status = action()
            sys.stdout.flush()
            return status
    except SystemExit as error:  # argparse, after --help and --version
        return error.code if isinstance(error.code, int) else 0
    except BrokenPipeError:
        # The reader of the output, such as `head`, has ended; flushing at exit would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except KeyboardInterrupt as error:
        what = str(error) or "all written files are complete; repeat the command to go on"
        _complain(f"stopped; {what}", error, debug)
        return STOPPED
    except Exception as error:  # reported as an internal error
        text, status = _explain(error)
        _complain(f"error: {text}", error, debug)
        return status


def _dispatch(words: list[str]) -> int:
    parser, commands = build_parser()
    arguments, unknown = parser.parse_known_args(words)
    if arguments.command is None:
        if unknown:
            parser.reject_unknown(unknown)
        parser.error(f"no command given; known: {', '.join(commands.parsers)}")
    if unknown:
        commands.parsers[arguments.command].reject_unknown(unknown)
    arguments.command_line = shlex.join(["smarticles", *words])
    if arguments.handler not in (run.run_scene, run.resume_directory):  # these listen for SIGUSR1
        release()
    status: int = arguments.handler(arguments)
    return status


def _explain(error: Exception) -> tuple[str, int]:
    if isinstance(error, InputError):
        return str(error), BAD_INPUT
    if isinstance(error, RunError):
        return str(error), FAILED
    if isinstance(error, ModuleNotFoundError) and error.name:
        return f"the Python package {error.name!r} is missing; {doctor.way_to_install(error.name)}", BAD_INPUT
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror or error}; free space, or check the path and its permissions", FAILED
    what = f"internal error, {type(error).__name__}: {error}"
    return f"{what}; please report it with the output of the same command with --debug", FAILED


def _complain(text: str, error: BaseException, debug: bool) -> None:
    # A terminal that was closed cannot show the text.
    with suppress(OSError):
        complain(" ".join(text.split()))
        if debug:
            traceback.print_exception(error)


def _stop(number: int, _frame: FrameType | None) -> None:
    if number == signal.SIGHUP:
        # Both the kernel and the shell send it when a terminal closes; the second must not disturb the stop.
        signal.signal(number, _ignore)
    raise KeyboardInterrupt


def _raise_again(dropped: "sys.UnraisableHookArgs") -> None:
    """Raise a KeyboardInterrupt later that Python has dropped, since it came within a destructor or a callback."""
    if isinstance(dropped.exc_value, KeyboardInterrupt):
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S)
    else:
        sys.__unraisablehook__(dropped)


def _ignore(_number: int, _frame: FrameType | None) -> None:
    """Ignore a signal in this process; unlike SIG_IGN, this handler is not inherited by child processes."""


@contextmanager
def orderly_stop() -> Iterator[None]:
    """Raise KeyboardInterrupt at SIGINT, SIGTERM and SIGHUP, so that a run closes its files.

    Signals that the process ignores already, because of `nohup` or `&` in a shell, stay ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before, hook = {number: signal.getsignal(number) for number in (*_SIGNALS, signal.SIGALRM)}, sys.unraisablehook
    try:
        for number, handler in before.items():
            signal.signal(number, _ignore if handler is signal.SIG_IGN else _stop)
        sys.unraisablehook = _raise_again
        yield
    finally:
        sys.unraisablehook = hook
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)
