"""Text for the terminal, in which control characters of names and causes are written as escapes."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, TextIO, cast

# Controls but tab and newline, marks that reverse the direction of text, and separators of lines. A terminal obeys
# them, so that a name could clear the screen, change colours, or look like another.
_OBEYED = [*range(9), *range(11, 32), *range(127, 160), 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
_ESCAPES = {code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}" for code in _OBEYED}


def escaped(text: str) -> str:
    r"""Return text with escapes, such as `\x1b`, for all control characters except tab and newline."""
    return text.translate(_ESCAPES)


class Control(str):
    """Text whose control characters are meant for the terminal and are not escaped."""

    __slots__ = ()


ERASE_LINE = Control("\r\x1b[K")


class Printable:
    """A text stream that writes control characters as escapes, except in texts of type `Control`."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write text with escapes; return the number of its characters."""
        self.stream.write(text if isinstance(text, Control) else escaped(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def redraw(text: str, *, last: bool = False) -> None:
    """Write text to standard error in place of the current line; `last` ends the line."""
    sys.stderr.write(ERASE_LINE)
    sys.stderr.write(text + "\n" * last)
    sys.stderr.flush()


def warn(text: str) -> None:
    """Print a warning to standard error."""
    print(f"smarticles: warning: {text}", file=sys.stderr)


def bare(stream: TextIO) -> TextIO:
    """Return the stream below a `Printable`, for the library rich, which writes control characters itself."""
    return stream.stream if isinstance(stream, Printable) else stream


@contextmanager
def printable() -> Iterator[None]:
    """Context manager in which standard output and error write control characters as escapes."""
    out, error = (cast(TextIO, Printable(stream)) for stream in (sys.stdout, sys.stderr))
    with redirect_stdout(out), redirect_stderr(error):
        yield
