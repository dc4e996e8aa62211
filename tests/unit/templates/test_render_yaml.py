"""Templates: values keep their type, cannot break out, and a misspelt name is an error."""

import gc
import os
import resource
import signal
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dem.errors import InputError
from templates.sweep.render import MOST_SECONDS, _limited, _TooLongError, evaluate, render_yaml


@pytest.mark.parametrize("text", ['a: b\ninjected: "yes"', "'; } ] --- # {{ 7 * 7 }}", "null", "", "value0z"])
@pytest.mark.parametrize("place", ["{{ s }}", '"{{ s }}"', "'{{ s }}'"])
def test_a_hostile_string_stays_one_string(text: str, place: str) -> None:
    data = render_yaml(f"before: 1\nkey: {place}\nflow: {{a: {place}, b: 2}}\n", {"s": text}, "t")
    assert data == {"before": 1, "key": text, "flow": {"a": text, "b": 2}}


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
        max_leaves=8,
    )
)
def test_every_plain_value_survives(value: Any) -> None:
    data = render_yaml("key: {{ v }}\nlist: [{{ v }}, 1]\n", {"v": value}, "t")
    assert data == {"key": value, "list": [value, 1]}
    assert type(data["key"]) is type(value)


def test_a_value_within_text_becomes_text() -> None:
    data = render_yaml('name: lw{{ x }}-{{ s }}\nquoted: "{{ x }}"', {"x": 0.7, "s": "#a: b"}, "t")
    assert data == {"name": "lw0.7-#a: b", "quoted": "0.7"}


@pytest.mark.parametrize(
    ("template", "message"),
    [
        ("a: {{ x", "t, line 1: unexpected end of template"),
        ("a: 1\nb: [1,\n", "t, line 3, column 1: not valid YAML"),
        ("a: 1\na: 2\n", r"t, line 2, column 1: not valid YAML: key 'a' is given twice"),
        ("a: {{ x.y }}", "has no attribute 'y'"),
        ("a: {{ x / 0 }}", "t, line 1: .*division"),
        ("a: !!python/object/apply:os.getcwd []", "could not determine a constructor"),
        ("a: {{ range }}", "gives function; it must give numbers, text or lists"),
        ("{% include 'other' %}", "t, line 1: no loader"),
        ("a: {{ x.__class__.__mro__ }}", "unsafe"),
        ("? [a]\n: 1", "a key must be plain"),
    ],
)
def test_mistakes_in_a_template_are_input_errors(template: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        render_yaml(template, {"x": 1}, "t")


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("n", 270),
        ("(n / 4) | round | int", 68),
        ("n // 2", 135),
        ("2 ** 3", 8),
        ("'a' ~ n", "a270"),
        ("[n, 1]", [270, 1]),
        ("n if n > 5 else 5", 270),
    ],
)
def test_expressions(expression: str, value: Any) -> None:
    result = evaluate(expression, {"n": 270}, "f: derived.x")
    assert result == value
    assert type(result) is type(value)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("m", "f: derived.x = 'm': 'm' is undefined; known: n"),
        ("m + 1", "'m' is undefined"),
        ("n.__class__", "unsafe"),
        ("n.__class__.__base__.__subclasses__()", "unsafe"),
        ("(n", "derived.x = '\\(n'"),
        ("range(3)", "gives range; an expression must give numbers or text"),
        ("n / 0", "division by zero"),
        ("(-1) ** 0.5", "gives complex"),
    ],
)
def test_bad_expressions_are_input_errors(expression: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        evaluate(expression, {"n": 270}, "f: derived.x")


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("'a' * 10 ** 10", "takes more than 256 MiB"),
        ("[0] * 10 ** 9", "takes more than 256 MiB"),
        ("'%01000000000d' % n", "takes more than 256 MiB"),
        ("'a' | center(10 ** 10)", "takes more than 256 MiB"),
        ("9 ** (9 ** 9) > n", "takes more than 1 s to compute; use smaller numbers and fewer loops"),
        ("9 ** 9999", "Exceeds the limit"),
        ("'a' * 10 ** 6", "gives more than 200000 characters"),
    ],
)
def test_an_expression_that_would_take_all_memory_or_hours_is_rejected(expression: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        evaluate(expression, {"n": 270}, "f: derived.x")


@pytest.mark.parametrize(
    ("template", "message"),
    [
        ("a: {{ 9 ** (9 ** 9) }}", "takes more than 1 s"),
        ("{% for a in range(99999) %}{% for b in range(99999) %}{% endfor %}{% endfor %}", "takes more than 1 s"),
        ("{% set x = namespace(t='ab') %}{% for a in range(99) %}{% set x.t = x.t ~ x.t %}{% endfor %}", "256 MiB"),
        ("{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}", "recursion"),
        ("{% for a in [1] %}" * 30 + "{% endfor %}" * 30, "too many statically nested blocks"),
        ("a: {{ [[[[['x'] * 50] * 50] * 50] * 50] * 50 }}", "takes more than"),
        ("a: {% for a in range(99999) %}xxx{% endfor %}", "more than 200000 characters"),
    ],
)
def test_a_template_that_would_take_all_memory_or_hours_is_rejected(template: str, message: str) -> None:
    limits = resource.getrlimit(resource.RLIMIT_AS), signal.getitimer(signal.ITIMER_VIRTUAL)
    with pytest.raises(InputError, match=message):
        render_yaml(template, {"x": 1}, "t")
    assert (resource.getrlimit(resource.RLIMIT_AS), signal.getitimer(signal.ITIMER_VIRTUAL)) == limits


class _Slow:
    """Takes longer than a rendering may, while it is deleted: Python passes over what is raised there."""

    def __del__(self) -> None:
        spin(MOST_SECONDS + 0.5)


def spin(seconds: float) -> None:
    """Compute for some seconds of the process's own time, which is what the limit counts (not the kernel's)."""
    end = os.times().user + seconds
    while os.times().user < end:
        sum(range(100_000))


def delete_slowly_and_go_on() -> None:
    with _limited():
        _Slow()
        spin(1.0)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_limit_that_is_exceeded_while_an_object_is_deleted_still_holds() -> None:
    with pytest.raises(_TooLongError):
        delete_slowly_and_go_on()
    assert gc.isenabled()


def test_garbage_of_others_takes_none_of_the_time() -> None:
    cycle: list[Any] = [_Slow()]
    cycle.append(cycle)
    del cycle
    with _limited():
        waste = [[number] for number in range(gc.get_threshold()[0] * 2)]
    assert len(waste) > 0
    gc.collect()
