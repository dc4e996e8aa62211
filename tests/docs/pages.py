"""Read the blocks of code of README and the documentation.

Every block has a language. `bash` is run as it stands, `python` as a script. `yaml`, `toml` and `jinja` begin with a
comment that names a file, and are written to it; `text` is output of a program. A block that a test cannot run has its
reason in the line above it: `<!-- not run: REASON -->`.
"""

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from markdown_it import MarkdownIt

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "docs"

RUN = frozenset({"bash", "python"})
WRITTEN = frozenset({"yaml", "toml", "jinja"})
SHOWN = frozenset({"text"})

_REASON = re.compile(r"<!-- not run: (.+?) -->\s*$")
_FILE = re.compile(r"^(?:#|\{#)\s*([\w.-]+\.\w+)\b")


@dataclass(frozen=True)
class Block:
    """One block of a page.

    Args:
        line: where it begins.
        language: after its fence; empty for a block that is only indented.
        text: its content.
        reason: why it is not run; None: it is run.
    """

    line: int
    language: str
    text: str
    reason: str | None

    @property
    def file(self) -> str | None:
        """File name in the first line; None: there is none."""
        named = _FILE.match(self.text)
        return named[1] if named else None


@dataclass(frozen=True)
class Page:
    """One page of Markdown."""

    path: Path

    @property
    def name(self) -> str:
        """Path relative to the repository."""
        return self.path.relative_to(REPOSITORY).as_posix()

    @cached_property
    def text(self) -> str:
        """Content of the file."""
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks of code in order, without directives of Sphinx."""
        found, reason = [], None
        for token in MarkdownIt().parse(self.text):
            if token.type == "html_block":
                said = _REASON.search(token.content)
                reason = said[1] if said else None
                continue
            if token.type in {"fence", "code_block"} and not token.info.startswith("{"):
                assert token.map is not None
                found.append(Block(token.map[0] + 1, token.info.strip(), token.content, reason))
            reason = None
        return tuple(found)

    @cached_property
    def made(self) -> tuple[Path, ...]:
        """Committed pictures that the commands of the page make, `docs/pictures/PAGE/NAME.png`.

        Pages of one name in different folders share a folder of pictures, so that the blocks decide.
        """
        text = "".join(block.text for block in self.blocks)
        pictures = (DOCS / "pictures" / self.path.stem).glob("*.png")
        return tuple(sorted(picture for picture in pictures if picture.name in text))


def pages() -> tuple[Page, ...]:
    """Return README and all pages of the documentation."""
    return tuple(Page(path) for path in (REPOSITORY / "README.md", *sorted(DOCS.rglob("*.md"))))
