"""Write `CLAIMS.md` and `claims.csv` into a folder of results: `python -m studies.claims [RESULTS]`."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from studies.claims.verdicts import Claim, Engines, Tested, claims

HEAD = """\
# The paper's claims, one by one

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023 (DOI 10.1039/d2sm01573k), in
its order; what its simulations say was tested twice where both are told: by the rules of the **text**, and by those of
the paper's own **code** where it says otherwise (`protocol: text` and `protocol: code`, spelled out by `smarticles
plan`). Made by `make claims` from the tables of the studies in this folder, which name scene, seed, versions and
command of every run; a test holds this page against them. Errors are standard errors; verdicts go by 95 %.

*Reproduced*: found beyond the 95 % half-width, by all rules it was tested by. *Partly*: by one of them. *Not*: by none,
and the opposite was found by one at least. *Not resolved*: neither; what it would take is told by the scatter there is.
*No data*: the runs are still to be made. *On YADE*: the same finding on the other engine, where it has runs of its own:
no say in the verdict, but it shows where engines differ. *By a test of ours*: the paper's own test of strength is held
fast by single smarticles that bridge its hooks; where it does not resolve a claim, the test that tears the pile decides
the verdict ([strength](strength/), [strength-code](strength-code/)).
"""


def text(found: Sequence[Claim]) -> str:
    """The page."""
    counted = Counter(claim.verdict for claim in found)
    lines = [
        HEAD,
        f"{len(found)} claims: " + ", ".join(f"{n} {verdict}" for verdict, n in counted.most_common()) + ".",
        "",
        engines(found),
        "",
    ]
    part = ""
    for claim in found:
        if claim.part != part:
            part = claim.part
            lines += [
                "",
                f"## {part}",
                "",
                "| | claim | verdict | by the text | by the code | text on YADE | code on YADE | rests on | why |",
                "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
            ]
        ours = (_told(tested) for tested in _all(claim))
        verdict = f"**{claim.verdict}**" + (" (otherwise on YADE)" if "opposite" in claim.engines.values() else "")
        cells = (str(claim.number), claim.says, verdict, *ours, _rests(claim), claim.why)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def engines(found: Sequence[Claim]) -> str:
    """What both engines say of the claims that both were asked, and which they are where they do not agree."""
    asked = [(claim.number, protocol, how) for claim in found for protocol, how in claim.engines.items()]

    def which(how: Engines) -> str:
        numbers = [f"{number} by the {protocol}" for number, protocol, one in asked if one == how]
        return ", ".join(numbers) or "none"

    alike = sum(how == "alike" for _, _, how in asked)
    return (
        f"Both engines were asked {len(asked)} findings of {len({number for number, _, _ in asked})} claims: {alike} "
        f"verdicts are the same. Opposite, for the reason told there: {which('opposite')}. Links alone resolves, by "
        f"more runs: {which('links alone tells')}. YADE alone: {which('YADE alone tells')}. "
        "All others rest on one engine, as told."
    )


def _told(tested: Tested | None) -> str:
    if tested is None:
        return "–"
    other = tested.instead
    instead = "" if other is None else f"by a test of ours, {other.study}: {_told(other)}"
    return "; ".join(filter(None, [f"{tested.verdict}: {tested.ours}", tested.needed, instead]))


def _all(claim: Claim) -> tuple[Tested | None, ...]:
    """By protocol and engine, in the order of the columns."""
    return claim.text, claim.code, claim.yade, claim.code_on_yade


def _rests(claim: Claim) -> str:
    tested = [one for by in _all(claim) if by is not None for one in (by, by.instead) if one is not None]
    told = [f"[{one.study}]({one.study}/): {one.basis}" for one in tested]
    return "; ".join(told) or "–"


def table(found: Sequence[Claim]) -> pd.DataFrame:
    """The same as one row per claim."""
    rows = []
    for claim in found:
        row = {
            "number": claim.number,
            "part": claim.part,
            "claim": claim.says,
            "verdict": claim.verdict,
            "why": claim.why,
        }
        for name, tested in zip(("text", "code", "text on YADE", "code on YADE"), _all(claim), strict=True):
            for key in ("study", "verdict", "ours", "criterion", "basis"):
                row[f"by the {name}: {key}"] = "" if tested is None else getattr(tested, key)
            if tested is not None and tested.instead is not None:
                row[f"by the {name}: by a test of ours"] = _told(tested.instead)
        rows.append(row)
    return pd.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write page and table."""
    parser = argparse.ArgumentParser(prog="python -m studies.claims", description=__doc__)
    parser.add_argument("results", type=Path, nargs="?", default=Path("results"), help="folder of the studies' results")
    folder: Path = parser.parse_args(arguments).results
    found = claims(folder)
    (folder / "CLAIMS.md").write_text(text(found), encoding="utf-8")
    table(found).to_csv(folder / "claims.csv", index=False)
    print(f"{folder / 'CLAIMS.md'}: {len(found)} claims")


if __name__ == "__main__":
    main()
