"""Render Jinja2 templates as text or as YAML data.

For YAML, each `{{ … }}` becomes a placeholder in the text. The text is parsed, and the placeholders in the data are
then replaced by the values. A value that is alone keeps its type, and no value can change the structure of the YAML.
"""

import gc
import os
import re
import resource
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

import jinja2
import yaml
from jinja2 import meta
from jinja2.runtime import Context
from jinja2.sandbox import ImmutableSandboxedEnvironment

from dem.errors import InputError, nearest, shown
from dem.yaml_text import LONGEST, StrictLoader, parse_yaml

Value = Any  #: Value of a variable: None, bool, int, float, str, or lists and mappings of such values


# What a rendering may take beyond the memory of the process [bytes], and its processor time [s]. Templates of the
# project take less than 10 MiB and 0.05 s; those of a stranger may multiply, repeat and nest loops without end.
MOST_MEMORY, MOST_SECONDS = 2**28, 1.0


class _TooLongError(BaseException):
    """Raised when a rendering takes too long.

    It is a BaseException since Jinja2 catches every Exception while it computes constants.
    """


@contextmanager
def _limited() -> Iterator[None]:
    """Raise MemoryError or `_TooLongError` if a rendering exceeds `MOST_MEMORY` or `MOST_SECONDS`.

    Without `/proc` the memory is not limited, and in threads other than the main one the time is not. Garbage is
    collected afterwards: in a process with many objects that takes as long as a rendering may, and Python passes over
    what is raised meanwhile. For the same reason the signal comes again every 0.1 s.
    """
    collected = gc.isenabled()
    timed = threading.current_thread() is threading.main_thread()
    before = resource.getrlimit(resource.RLIMIT_AS)
    statm = Path("/proc/self/statm")
    gc.disable()
    try:
        if statm.exists():
            most = int(statm.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE") + MOST_MEMORY
            soft = most if before[0] == resource.RLIM_INFINITY else min(before[0], most)
            resource.setrlimit(resource.RLIMIT_AS, (soft, before[1]))
        if timed:
            handler = signal.signal(signal.SIGVTALRM, _stop)
            signal.setitimer(signal.ITIMER_VIRTUAL, MOST_SECONDS, 0.1)
        yield
    finally:
        if timed:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            signal.signal(signal.SIGVTALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)
        if collected:
            gc.enable()


def _stop(_number: int, _frame: FrameType | None) -> None:
    raise _TooLongError


def _environment(finalize: Callable[..., Any] | None = None) -> ImmutableSandboxedEnvironment:
    """Return a sandboxed environment of Jinja2 in which an unknown name is an error.

    `finalize` converts the value of each `{{ … }}` before it is inserted; None: no conversion.
    """
    return ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined,
        finalize=finalize,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _plain(value: Value) -> bool:
    if isinstance(value, list | tuple):
        return all(_plain(item) for item in value)
    if isinstance(value, dict):
        return all(isinstance(key, str) and _plain(item) for key, item in value.items())
    return value is None or isinstance(value, bool | int | float | str)


def _check(value: Value, rule: str) -> None:
    """Raise an error of Jinja2, ending with `rule`, if a value is undefined, no plain data, or too long."""
    if isinstance(value, jinja2.Undefined):
        str(value)  # StrictUndefined raises, with the name
    if not _plain(value):
        raise jinja2.TemplateRuntimeError(f"gives {type(value).__name__}; {rule}")
    if len(str(value)) > LONGEST:
        raise jinja2.TemplateRuntimeError(f"gives more than {LONGEST} characters; {rule}")


def _line(error: BaseException) -> int | None:
    """Return the line of the template at which rendering failed; None if it is unknown."""
    line, step = None, error.__traceback__
    while step is not None:
        if step.tb_frame.f_code.co_filename == "<template>":
            line = step.tb_lineno
        step = step.tb_next
    return line


def _reject(error: BaseException, where: str, values: Mapping[str, Value]) -> NoReturn:
    text = " ".join(str(error).split())
    if isinstance(error, MemoryError | _TooLongError):
        most = f"{MOST_MEMORY >> 20} MiB" if isinstance(error, MemoryError) else f"{MOST_SECONDS:g} s"
        msg = f"{where}: takes more than {most} to compute; use smaller numbers and fewer loops"
    elif isinstance(error, jinja2.UndefinedError):
        name = re.match(r"'([^']+)' is undefined", text)
        advice = nearest(name[1], sorted(values)) if name else f"defined: {', '.join(sorted(values))}"
        msg = f"{where}: {text}; {advice}"
    else:
        msg = f"{where}: {text or type(error).__name__}; correct it"
    raise InputError(msg) from error


# Errors of Jinja2, and of Python in expressions.
_FAILURES = (
    *(jinja2.TemplateError, ArithmeticError, TypeError, ValueError, LookupError, AttributeError, RuntimeError),
    *(SyntaxError, MemoryError, _TooLongError),
)


def evaluate(expression: str, values: Mapping[str, Value], source: str) -> Value:
    """Return the value of a Jinja2 expression such as `(n / 2) | round | int`.

    InputError if it fails or has an unknown name; `source` says in the message where the expression is.
    """
    try:
        with _limited():
            result = _environment().compile_expression(expression, undefined_to_none=False)(**values)
            _check(result, "an expression must give numbers or text")
    except _FAILURES as error:
        _reject(error, f"{source} = {shown(expression)}", values)
    return result


def variables_of(template: str) -> set[str]:
    """Return the names of the variables that a template uses; jinja2.TemplateError if it is not valid."""
    return meta.find_undeclared_variables(_environment().parse(template))


def render_text(template: str, values: Mapping[str, Value], source: str) -> str:
    """Render a template as text.

    InputError if it fails or has an unknown name; `source` says in the message where the template is.
    """
    try:
        with _limited():
            return _environment().from_string(template).render(**values)
    except _FAILURES as error:
        _reject(error, f"{source} = {shown(template)}", values)


def render_yaml(template: str, values: Mapping[str, Value], source: str) -> Any:
    """Render a template of YAML, and return its data.

    InputError if it fails or has an unknown name; the message has `source`, the place of the template, and the line.
    """
    prefix = "value"
    while prefix in template or prefix in repr(values):
        prefix += "x"
    held: list[Value] = []

    @jinja2.pass_context  # so that Jinja2 does not call this at compile time for constants
    def hold(_: Context, value: Value) -> str:
        _check(value, "it must give numbers, text or lists")
        held.append(value)
        return f"{prefix}{len(held) - 1}z"

    environment = _environment(hold)
    try:
        with _limited():
            text = environment.from_string(template).render(**values)
    except _FAILURES as error:
        number = getattr(error, "lineno", None) or _line(error)
        _reject(error, f"{source}, line {number}" if number else source, values)
    return parse_yaml(text, source, _loader(re.compile(rf"{prefix}(\d+)z"), held))


def _loader(placeholder: re.Pattern[str], held: list[Value]) -> type[StrictLoader]:
    class Loader(StrictLoader):
        pass

    def construct(_: Loader, node: yaml.ScalarNode) -> Value:
        whole = placeholder.fullmatch(node.value)
        if whole and node.style is None:
            return held[int(whole[1])]

        def text(found: re.Match[str]) -> str:
            value = held[int(found[1])]
            if isinstance(value, list | tuple | dict):
                problem = f"a list or mapping within text: {value!r}"
                raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
            if value is None or isinstance(value, bool):
                return {None: "null", True: "true", False: "false"}[value]
            return str(value)

        return placeholder.sub(text, node.value)

    Loader.add_constructor("tag:yaml.org,2002:str", construct)
    return Loader
