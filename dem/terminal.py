"""Text for the terminal: control characters as escapes, and spellings for terminals without UTF-8."""

import codecs
import shutil
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from io import TextIOWrapper
from textwrap import wrap
from typing import Any, TextIO, cast

# Controls but tab and newline, marks that reverse the direction of text, and separators of lines. A terminal obeys
# them, so that a name could clear the screen, change colours, or look like another.
_OBEYED = [*range(9), *range(11, 32), *range(127, 160), 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
_ESCAPES = {code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}" for code in _OBEYED}

_SPELLED = "smarticles.spelled"  # name of the handler of characters that an encoding lacks
_SPELLINGS = {
    **{"⟨": "<", "⟩": ">", "…": "...", "±": "+-", "×": "x", "·": "*", "−": "-", "–": "-", "°": " deg", "∞": "inf"},
    **{"√": "sqrt", "≤": "<=", "≥": ">=", "≈": "~", "∫": "integral", "∂": "d", "÷": "/", "²": "^2", "³": "^3"},
    **{"ℓ": "l", "µ": "u", "∑": "sum", "“": '"', "”": '"', "✔": "+", "✘": "x", "■": "-", "█": "#"},
}


def escaped(text: str) -> str:
    r"""Return text with escapes, such as `\x1b`, for all control characters except tab and newline."""
    return text.translate(_ESCAPES)


def spelled(character: str) -> str:
    r"""Return an ASCII spelling of a character, such as `phi` for φ; an escape such as `\u4e00` if it has none."""
    if character in _SPELLINGS:
        return _SPELLINGS[character]
    name = unicodedata.name(character, "")
    if name.startswith("GREEK") and " LETTER " in name:
        letter = name.partition(" LETTER ")[2].split()[0].lower()
        return letter.capitalize() if "CAPITAL" in name else letter
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    return plain or character.encode("ascii", "backslashreplace").decode()


def _spell(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(spelled, error.object[error.start : error.end])), error.end


codecs.register_error(_SPELLED, _spell)


def writes_unicode(stream: TextIO) -> bool:
    """Return whether a stream writes all characters; streams without an encoding, such as notebooks, do."""
    return (getattr(stream, "encoding", None) or "utf-8").lower().replace("-", "").startswith("utf")


@contextmanager
def spelling(*streams: TextIO) -> Iterator[None]:
    """Context manager in which streams write spellings for characters that their encodings lack."""
    with ExitStack() as stack:
        for stream in streams:
            if isinstance(stream, TextIOWrapper) and stream.errors == "strict" and not writes_unicode(stream):
                stream.reconfigure(errors=_SPELLED)
                stack.callback(stream.reconfigure, errors="strict")
        yield


class Printable:
    """A text stream that writes control characters as escapes."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write text with escapes; return the number of its characters."""
        self.stream.write(escaped(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def warn(text: str) -> None:
    """Print a warning to standard error."""
    print(f"smarticles: warning: {text}", file=sys.stderr)


def bare(stream: TextIO) -> TextIO:
    """Return the stream below a `Printable`, for the library rich, which writes control characters itself."""
    return stream.stream if isinstance(stream, Printable) else stream


@contextmanager
def printable() -> Iterator[None]:
    """Context manager in which standard output and error write escapes for controls, and spellings where needed."""
    with spelling(sys.stdout, sys.stderr):
        out, error = (cast(TextIO, Printable(stream)) for stream in (sys.stdout, sys.stderr))
        with redirect_stdout(out), redirect_stderr(error):
            yield


def screen_width(stream: TextIO | None = None) -> int | None:
    """Return the number of columns of the terminal that a stream, by default standard output, writes to.

    None if it is no terminal: lines then may have any length.
    """
    stream = stream or sys.stdout
    return shutil.get_terminal_size().columns if stream.isatty() else None


def folded(text: str, *, width: int | None, indent: str = "") -> str:
    """Break the lines of a text that are longer than `width` characters; None: nothing is broken.

    Continued lines begin with the spaces of their line and `indent`.
    """
    if width is None:
        return text
    lines = []
    for line in text.splitlines():
        start = line[: len(line) - len(line.lstrip())] + indent
        options: dict[str, Any] = {"break_on_hyphens": False, "break_long_words": False}
        lines += [line] if len(line) <= width else wrap(line, width, subsequent_indent=start, **options)
    return "\n".join(lines)
