"""Text for the terminal: control characters as escapes, and spellings for terminals without UTF-8."""

import codecs
import re
import shutil
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from io import TextIOWrapper
from typing import Any, TextIO, cast

# Controls but tab and newline, marks that reverse the direction of text, and separators of lines. A terminal obeys
# them, so that a name could clear the screen, change colours, or look like another.
_OBEYED = [*range(9), *range(11, 32), *range(127, 160), 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
_ESCAPES = {code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}" for code in _OBEYED}

_LONGEST_LINE = 100  # characters of running text, which is hard to read in wider lines
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
    """Context manager in which streams write spellings for characters that their encodings lack.

    UTF-8 lacks the characters that stand for undecodable bytes in names of files.
    """
    with ExitStack() as stack:
        for stream in streams:
            if isinstance(stream, TextIOWrapper):
                stack.callback(stream.reconfigure, errors=stream.errors)
                stream.reconfigure(errors=_SPELLED)
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


def say(text: str) -> None:
    """Print text to standard output, in lines that fit a terminal."""
    print(folded(text, width=screen_width()), flush=True)


def complain(text: str) -> None:
    """Print a message of the program to standard error, in lines that fit a terminal."""
    print(folded(f"smarticles: {text}", width=screen_width(sys.stderr), at="; "), file=sys.stderr)


def warn(text: str) -> None:
    """Print a warning to standard error."""
    complain(f"warning: {text}")


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


def text_width() -> int:
    """Return the length of lines of running text on standard output."""
    return min(screen_width() or _LONGEST_LINE, _LONGEST_LINE)


def screen_width(stream: TextIO | None = None) -> int | None:
    """Return the number of columns of the terminal that a stream, by default standard output, writes to.

    None if it is no terminal: lines then may have any length.
    """
    stream = stream or sys.stdout
    return shutil.get_terminal_size().columns if stream.isatty() else None


def folded(text: str, *, width: int | None, at: str = " ") -> str:
    """Break the lines of a text that are longer than `width` characters; None: nothing is broken.

    Lines are broken at the text `at`, and between words where that is not enough. Continued lines begin below the last
    gap of two or more spaces in the first four fifths of their line, so that columns stay columns; without a gap they
    begin with two spaces.
    """
    if width is None:
        return text
    return "\n".join(piece for line in text.split("\n") for piece in _pieces(line, width, at))


def _pieces(line: str, width: int, at: str) -> list[str]:
    if len(line) <= width:
        return [line]
    room = min(4 * width // 5, width - max(map(len, line.split()), default=0))
    gaps = [gap.end() for gap in re.finditer(r"^ +|  +", line) if gap.end() <= room]
    indent = " " * (gaps[-1] if gaps else 2)
    words = line.lstrip(" ")
    pieces = [line[: len(line) - len(words)]]
    for part in words.split(at):
        joined = pieces[-1] + (at if pieces[-1].strip() else "") + part
        if len(joined) > width and pieces[-1].strip():
            pieces[-1] += at.rstrip()
            pieces.append(indent + part)
        else:
            pieces[-1] = joined
    if at == " ":
        return pieces
    return [short for piece in pieces for short in _pieces(piece, width, " ")]
