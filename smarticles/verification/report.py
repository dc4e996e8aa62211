"""Known answers, judged and told: from tables to orders, a report and figures.

The tables are computed in another process, which loads YADE.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from postprocess.report.markdown import table_lines
from postprocess.statistics.convergence import observed_order
from smarticles.verification import figures as verification_figures
from studies.framework.provenance import markdown_ending, write_tables, write_text

BAND = 0.3
"""An observed order passes within this of the scheme's [1]: no order in between the first and the second does."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Verification:
    """Known answers and how they were met.

    Attributes:
        checks: One row per quantity, see `smarticles.verification.tables`.
        orders: One row per ladder over the time step.
        clumps: One row per sphere chain, flat impacts.
        failed: What is not as it must be, one line each.
        told: What it means, one sentence each.
        files: All that was written, by name.
    """

    checks: pd.DataFrame
    orders: pd.DataFrame
    clumps: pd.DataFrame
    failed: tuple[str, ...]
    told: tuple[str, ...]
    files: Mapping[str, Path]


def report_verification(folder: Path, *, command: str) -> Verification:
    """Judges the tables of a folder; writes orders.csv, verification.md and two figures beside them.

    Args:
        folder: With verification.csv, trajectories.csv, clumps.csv and versions.json.
        command: Command line.

    Raises:
        InputError: A table is missing or cannot be read.
    """
    absent = pd.read_csv(folder / "absent.csv") if (folder / "absent.csv").exists() else pd.DataFrame(columns=["case"])
    checks, trajectories, clumps = (
        _read(folder / f"{name}.csv") for name in ("verification", "trajectories", "clumps")
    )
    versions = json.loads((folder / "versions.json").read_text(encoding="utf-8"))
    orders = order_table(trajectories)
    failed = [
        f"{row['case']}, {row['quantity']}: {row['measured [unit]']:.6g} {row['unit']}, theory "
        f"{row['theory [unit]']:.6g}: error {row['error [1]']:.2g}, tolerance {row['tolerance [1]']:.2g}"
        for row in checks[~checks["ok"]].to_dict("records")
    ]
    failed += [
        f"{row['ladder']}: observed order {row['order observed [1]']:.2f}, the scheme's is "
        f"{row['order of the scheme [1]']} ± {BAND:g}"
        for row in orders[~orders["ok"]].to_dict("records")
    ]
    told = clump_sentences(clumps)
    footer = (
        "Single simulations without randomness: nothing scatters, so there are no error bars.",
        "Versions: "
        + "; ".join(
            f"{name} {versions.get(name, 'unknown')}" for name in ("smarticles", "git", versions.get("engine", "yade"))
        ),
        f"Command: {command}",
    )
    written = write_tables(folder, {"orders": orders}, footer)
    lines = _markdown(checks, orders, clumps, absent, failed=failed, told=told)
    written["verification.md"] = write_text(
        "\n".join([*lines, *markdown_ending((), footer)]), folder / "verification.md"
    )
    drawn = [
        *verification_figures.draw_orders(folder / "orders", trajectories=trajectories, orders=orders, footer=footer),
        *verification_figures.draw_clumps(folder / "clumps", clumps=clumps, footer=footer),
    ]
    return Verification(
        checks=checks,
        orders=orders,
        clumps=clumps,
        failed=tuple(failed),
        told=told,
        files=written | {path.name: path for path in drawn},
    )


def _read(path: Path) -> pd.DataFrame:
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        msg = f"{path}: cannot be read ({error}); compute it by `smarticles verify --out DIR`"
        raise InputError(msg) from None


def order_table(trajectories: pd.DataFrame) -> pd.DataFrame:
    """Observed orders, from the errors of each ladder at its time steps.

    Args:
        trajectories: One row per ladder and time step.
    """
    rows = []
    for name, group in trajectories.groupby("ladder", sort=False):
        ladder = group.sort_values("time step [s]", ascending=False)
        steps, errors = ladder["time step [s]"].to_numpy(), ladder["error [unit]"].to_numpy()
        fit = observed_order(steps, errors, exact=0.0)
        scheme = int(ladder["order of the scheme [1]"].iloc[0])
        rows.append(
            {
                "ladder": name,
                "about": ladder["about"].iloc[0],
                "quantity": ladder["quantity"].iloc[0],
                "unit": ladder["unit"].iloc[0],
                "order of the scheme [1]": scheme,
                "order observed [1]": fit.order,
                "standard error [1]": fit.standard_error,
                "orders between steps [1]": " ".join(f"{order:.2f}" for order in fit.local_orders),
                "coarsest step [s]": steps[0],
                "error at the coarsest step [unit]": errors[0],
                "finest step [s]": steps[-1],
                "error at the finest step [unit]": errors[-1],
                "ok": bool(abs(fit.order - scheme) <= BAND),
                "why": ladder["why"].iloc[0],
            }
        )
    return pd.DataFrame(rows)


def clump_sentences(clumps: pd.DataFrame) -> tuple[str, ...]:
    """What flat impacts over the number of spheres mean for users."""
    if clumps.empty:
        return ()
    few, many = (clumps.loc[index] for index in (clumps["contacts [1]"].idxmin(), clumps["contacts [1]"].idxmax()))
    if few["contacts [1]"] == many["contacts [1]"]:
        return (
            f"Restitution asked for is {few['restitution asked for [1]']:g}, that of one contact. A smarticle that "
            f"falls flat touches with the {few['contacts [1]']:.0f} ends of its links, whatever its section, and keeps "
            f"{few['restitution measured [1]']:.2f} of its speed.",
        )
    depth = few["depth at rest measured [m]"] / many["depth at rest measured [m]"]
    time = few["contact time measured [s]"] / many["contact time measured [s]"]
    return (
        f"Restitution asked for is {few['restitution asked for [1]']:g}, that of one contact. A smarticle that falls "
        f"flat keeps {few['restitution measured [1]']:.2f} of its speed on {few['contacts [1]']:.0f} contacts and "
        f"{many['restitution measured [1]']:.2f} on {many['contacts [1]']:.0f}: "
        "n dashpots side by side damp √n times more.",
        f"From {few['contacts [1]']:.0f} to {many['contacts [1]']:.0f} contacts it sinks in {depth:.1f} times less "
        f"and touches {time:.1f} times shorter: n springs side by side are n times as stiff. More "
        "of them do not converge to a flat face of the same restitution and stiffness; these are properties of a "
        "contact, not of the body.",
    )


def told_checks(checks: pd.DataFrame) -> tuple[list[str], list[list[object]]]:
    """The table of checks for a terminal or a report: header and rows."""
    header = ["case", "quantity", "unit", "theory", "measured", "error", "tolerance", "ok"]
    rows: list[list[object]] = [
        [
            row["case"],
            row["quantity"],
            row["unit"],
            float(row["theory [unit]"]),
            float(row["measured [unit]"]),
            f"{row['error [1]']:+.1e}",
            f"{row['tolerance [1]']:.1e}",
            "yes" if row["ok"] else "NO",
        ]
        for row in checks.to_dict("records")
    ]
    return header, rows


def told_orders(orders: pd.DataFrame) -> tuple[list[str], list[list[object]]]:
    """The table of orders: header and rows."""
    header = ["ladder", "quantity", "scheme", "observed", "± SE", "between steps", "ok"]
    rows: list[list[object]] = [
        [
            row["ladder"],
            row["quantity"],
            row["order of the scheme [1]"],
            f"{row['order observed [1]']:.2f}",
            f"{row['standard error [1]']:.2f}",
            row["orders between steps [1]"],
            "yes" if row["ok"] else "NO",
        ]
        for row in orders.to_dict("records")
    ]
    return header, rows


def told_clumps(clumps: pd.DataFrame) -> tuple[list[str], list[list[object]]]:
    """The table of flat impacts: header and rows."""
    columns = {
        "rows": ("rows [1]", "g"),
        "pitch": ("pitch [1]", "g"),
        "spheres": ("spheres [1]", "g"),
        "contacts": ("contacts [1]", "g"),
        "e asked": ("restitution asked for [1]", ".2f"),
        "e flat, theory": ("restitution, n in parallel and tilt [1]", ".3f"),
        "e flat": ("restitution measured [1]", ".3f"),
        "e at the scene's step": ("restitution at the scene's time step [1]", ".3f"),
        "contact time [µs], theory": ("contact time, theory [s]", "µ"),
        "contact time [µs]": ("contact time measured [s]", "µ"),
        "depth [nm], theory": ("depth at rest, theory [m]", "n"),
        "depth [nm]": ("depth at rest measured [m]", "n"),
        "scene's step [µs]": ("time step of the scene [s]", "µ"),
    }
    rows: list[list[object]] = [
        [_shown(float(row[column]), form) for column, form in columns.values()] for row in clumps.to_dict("records")
    ]
    return list(columns), rows


def _shown(value: float, form: str) -> str:
    scale = {"µ": 1e6, "n": 1e9}.get(form)
    return format(value, form) if scale is None else f"{value * scale:.1f}"


def _markdown(
    checks: pd.DataFrame,
    orders: pd.DataFrame,
    clumps: pd.DataFrame,
    absent: pd.DataFrame,
    *,
    failed: Sequence[str],
    told: Sequence[str],
) -> list[str]:
    passed = int(checks["ok"].sum()), int(orders["ok"].sum())
    return [
        "# Known answers",
        "",
        f"{passed[0]} of {len(checks)} quantities and {passed[1]} of {len(orders)} orders are as theory has them.",
        *(f"- **not**: {line}" for line in failed),
        "",
        "Errors are relative to the theory, or to the scale that `verification.csv` names where theory is zero; "
        "reasons of tolerances and sources are there.",
        "",
        *_table(*told_checks(checks)),
        "",
        *_told_absent(absent),
        "## Order in the time step",
        "",
        f"The scheme's order, ± {BAND:g}.",
        "",
        *_table(*told_orders(orders)),
        "",
        *(f"- {row['ladder']}: {row['about']}; {row['why']}." for row in orders.to_dict("records")),
        "",
        "![](orders.png)",
        "",
        "## Flat impacts over the number of points that touch",
        "",
        *told,
        "",
        *_table(*told_clumps(clumps)),
        "",
        "![](clumps.png)",
    ]


def _told_absent(absent: pd.DataFrame) -> list[str]:
    """Cases that have no meaning on this engine, and why."""
    if absent.empty:
        return []
    return [
        "Not applicable on this engine:",
        "",
        *(f"- {row['case']}: {row['why']}." for row in absent.to_dict("records")),
        "",
    ]


def _table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    cells = [[f"{value:.6g}" if isinstance(value, float) else str(value) for value in row] for row in rows]
    return table_lines(header, cells)
