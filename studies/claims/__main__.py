"""Write `CLAIMS.md`, `claims.yaml` and its schema into a folder of results: `python -m studies.claims [RESULTS]`."""

import argparse
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from postprocess.report.tables import table_lines
from studies.claims.records import write_records
from studies.claims.verdicts import Claim, Tested, claims

HEAD = """\
# The paper's claims, one by one

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023 (DOI 10.1039/d2sm01573k), in
its order. What its simulations say was tested twice where both rules are published: under those of the **text**, and
under those of the paper's own **code** where it differs (`protocol: text` and `protocol: code`, spelled out by
`smarticles plan`). Made by `make claims` from the tables of the studies in this folder, which name scene, seed,
versions and command of every run; a test compares this page with them. Errors are standard errors; verdicts go by 95 %.

*Reproduced*: found beyond the 95 % half-width under all rules it was tested under. *Partly*: under one of them. *Not*:
under none, and the opposite was found under one at least. *Not resolved*: neither; the scatter gives what it would
take. *No data*: the runs are still to be made. *On YADE*: the finding on the other engine, where it has runs of its
own: no part of the verdict, but it shows where engines differ. *By a test of ours*: in the paper's own test of strength
single smarticles that bridge its hooks hold fast; where it does not resolve a claim, the test that tears the pile
decides the verdict ([strength-main](strength-main/), [strength-main-rigid](strength-main-rigid/); over θ
[strength](strength/), [strength-code](strength-code/)).
"""
_HEADER = ("", "claim", "verdict", "by the text", "by the code", "text on YADE", "code on YADE", "rests on", "why")


def text(found: Sequence[Claim]) -> str:
    """Return the text of `CLAIMS.md`."""
    counts = ", ".join(f"{n} {verdict}" for verdict, n in Counter(claim.verdict for claim in found).most_common())
    lines = [HEAD, f"{len(found)} claims: {counts}.", "", engines(found), ""]
    for part, group in groupby(found, key=lambda claim: claim.part):
        lines += ["", f"## {part}", "", *table_lines(_HEADER, map(_row, group))]
    return "\n".join(lines) + "\n"


def _row(claim: Claim) -> list[str]:
    verdict = f"**{claim.verdict}**" + (" (otherwise on YADE)" if "opposite" in claim.engines.values() else "")
    tested = [claim.tested[name] for name in ("text", "code", "text on YADE", "code on YADE")]
    every = [one for by in tested if by is not None for one in (by, by.instead) if one is not None]
    rests = "; ".join(f"[{one.study}]({one.study}/): {one.basis}" for one in every) or "–"
    cells = (str(claim.number), claim.says, verdict, *map(_numbers, tested), rests, claim.why)
    return [cell.replace("|", "\\|") for cell in cells]


def _numbers(tested: Tested | None) -> str:
    if tested is None:
        return "–"
    other = tested.instead
    instead = "" if other is None else f"by a test of ours, {other.study}: {_numbers(other)}"
    return "; ".join(filter(None, [f"{tested.verdict}: {tested.ours}", tested.needed, instead]))


def engines(found: Sequence[Claim]) -> str:
    """Return a statement on the findings that were judged on both engines."""
    asked = [(f"{claim.number} by the {protocol}", how) for claim in found for protocol, how in claim.engines.items()]
    which = {one: ", ".join(name for name, how in asked if how == one) or "none" for one in _HOW}
    claimed = len({name.split()[0] for name, _ in asked})
    return (
        f"Both engines judge {len(asked)} findings of {claimed} claims: {sum(how == 'alike' for _, how in asked)} "
        f"verdicts are equal. Opposite, for the reason given there: {which['opposite']}. Resolved by links alone, with "
        f"more runs: {which['links alone']}. By YADE alone: {which['YADE alone']}. All others rest on one engine."
    )


_HOW = ("opposite", "links alone", "YADE alone")


def main(arguments: Sequence[str] | None = None) -> None:
    """Write `CLAIMS.md`, `claims.yaml` and its schema."""
    parser = argparse.ArgumentParser(prog="python -m studies.claims", description=__doc__)
    parser.add_argument("results", type=Path, nargs="?", default=Path("results"), help="folder of the studies' results")
    folder: Path = parser.parse_args(arguments).results
    found = claims(folder)
    (folder / "CLAIMS.md").write_text(text(found), encoding="utf-8")
    write_records(found, folder)
    print(f"{folder / 'CLAIMS.md'}, {folder / 'claims.yaml'}: {len(found)} claims")


if __name__ == "__main__":
    main()
