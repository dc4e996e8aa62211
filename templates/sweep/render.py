"""Render Jinja2 templates as text or as YAML data.

For YAML, each `{{ … }}` becomes a placeholder in the text. The text is parsed, and the placeholders in the data are
then replaced by the values. A value that is alone keeps its type, and no value can change the structure of the YAML.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

import jinja2
import yaml
from jinja2.runtime import Context
from jinja2.sandbox import ImmutableSandboxedEnvironment

from dem.errors import InputError, nearest
from dem.scene.yaml_text import StrictLoader, parse_yaml

Value = Any  #: Value of a variable: None, bool, int, float, str, or lists and mappings of such values


def _environment(finalize: Callable[..., Any] | None = None) -> ImmutableSandboxedEnvironment:
    """Return a sandbox in which an unknown name is an error."""
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


def _line(error: BaseException) -> int | None:
    """Return the line of the template at which rendering failed; None if it is unknown."""
    line, step = None, error.__traceback__
    while step is not None:
        if step.tb_frame.f_code.co_filename == "<template>":
            line = step.tb_lineno
        step = step.tb_next
    return line


def _reject(error: Exception, where: str, values: Mapping[str, Value]) -> NoReturn:
    text = " ".join(str(error).split())
    if isinstance(error, jinja2.UndefinedError):
        name = re.match(r"'([^']+)' is undefined", text)
        advice = nearest(name[1], sorted(values)) if name else f"defined: {', '.join(sorted(values))}"
        msg = f"{where}: {text}; {advice}"
    else:
        msg = f"{where}: {text or type(error).__name__}; correct it"
    raise InputError(msg) from error


# Errors of Jinja2, and of Python in expressions.
_FAILURES = (jinja2.TemplateError, ArithmeticError, TypeError, ValueError, LookupError)


def evaluate(expression: str, values: Mapping[str, Value], source: str) -> Value:
    """Return the value of a Jinja2 expression such as `(n / 2) | round | int`, or raise InputError."""
    environment = _environment()
    try:
        result = environment.compile_expression(expression, undefined_to_none=False)(**values)
        if isinstance(result, jinja2.Undefined):
            str(result)  # StrictUndefined raises, with the name
    except _FAILURES as error:
        _reject(error, f"{source} = {expression!r}", values)
    if not _plain(result):
        what = type(result).__name__
        raise InputError(f"{source} = {expression!r}: gives {what}; an expression must give numbers or text")
    return result


def render_text(template: str, values: Mapping[str, Value], source: str) -> str:
    """Render a template as text, not as YAML; raise InputError if it fails or uses an unknown name."""
    try:
        return _environment().from_string(template).render(**values)
    except _FAILURES as error:
        _reject(error, f"{source} = {template!r}", values)


def render_yaml(template: str, values: Mapping[str, Value], source: str) -> Any:
    """Render a template of YAML and return its data; on an error raise InputError with its line."""
    prefix = "value"
    while prefix in template or prefix in repr(values):
        prefix += "x"
    held: list[Value] = []

    @jinja2.pass_context  # so that Jinja2 does not call this at compile time for constants
    def hold(_: Context, value: Value) -> str:
        if isinstance(value, jinja2.Undefined):
            str(value)  # StrictUndefined raises, with the name
        if not _plain(value):
            msg = f"{{{{ … }}}} gives {type(value).__name__}; it must give numbers, text or lists"
            raise jinja2.TemplateRuntimeError(msg)
        held.append(value)
        return f"{prefix}{len(held) - 1}z"

    environment = _environment(hold)
    try:
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
