"""The index of `results/`: of each folder the one line that its README begins with."""

from __future__ import annotations

from pathlib import Path

from made.tables import code, table

RESULTS = Path(__file__).resolve().parents[2] / "results"


def finding(readme: Path) -> tuple[str, str]:
    """Title and finding of a README: its heading, and the line quoted under it.

    Raises:
        LookupError: it does not begin with both.
    """
    lines = [line for line in readme.read_text(encoding="utf-8").splitlines() if line.strip()]
    if not (len(lines) > 1 and lines[0].startswith("# ") and lines[1].startswith("> ")):
        msg = f"{readme}: must begin with a heading, '# …', and the finding in one line with its numbers, '> …'"
        raise LookupError(msg)
    return lines[0].removeprefix("# "), lines[1].removeprefix("> ")


def results_index() -> str:
    """Every folder of results with its finding."""
    rows = []
    for readme in sorted(RESULTS.glob("*/README.md")):
        _, said = finding(readme)
        rows.append((code(f"results/{readme.parent.name}"), said.replace("|", "\\|")))
    return table(("folder", "what was found"), rows)
