"""One row per run of the study `chain`, and means over trials; what is measured is in `postprocess.measures.strain`."""

from __future__ import annotations

import pandas as pd

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.measures.strain import QUANTITIES, STRAIN, YIELD, measured, read_strain_test
from postprocess.scene_file import read_phases
from postprocess.statistics.columns import SEED, SEEDS
from postprocess.statistics.points import averaged

BASELINE = "baseline"

VARIANT, COUNT, CONFINEMENT, SPEED = "variant", "smarticles [-]", "h/H [-]", "speed [m/s]"
START = "width at the start [m]"

PAPER_WIDTH = 0.062
"""h of the paper [m]. Links of one thickness are chosen such that a chain is as wide. With bodies of their own it is no
chain's outer width, and h/H only says where walls are: where the paper's are."""


def chain_row(run: RunManifest) -> dict[str, object]:
    """One run's row of the table of runs.

    Raises:
        InputError: It is no strain test, or cannot be read.
    """
    strained = [phase for phase in read_phases(run.directory) if phase.type == STRAIN]
    if len(strained) != 1:
        msg = f"{run.directory}: {len(strained)} phases that strain a chain; give runs of the study chain"
        raise InputError(msg)
    pull = read_strain_test(run)
    width = float(pull.widths[0]) if run.middle_thickness_in_plane is None else PAPER_WIDTH
    row: dict[str, object] = {
        VARIANT: run.name,
        COUNT: run.count,
        CONFINEMENT: round(width / run.channel_width, 3) if run.channel_width else 0.0,
        SEED: run.seed,
        SPEED: strained[0].number("speed_m_per_s"),
        START: float(pull.widths[0]),
        **measured(pull),
        "scene_sha256": run.scene_sha256,
        "run": run.directory.name,
    }
    return row


def points(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per variant, number of smarticles and confinement: means over trials with their errors.

    Args:
        runs: Table of runs, see `chain_row`.

    Returns:
        The table; `… SE` is the standard error, `… 95 %` the half-width of the confidence interval.
    """
    rows = []
    for (variant, count, confinement, speed), group in runs.groupby([VARIANT, COUNT, CONFINEMENT, SPEED]):
        row: dict[str, object] = {
            VARIANT: variant,
            COUNT: count,
            CONFINEMENT: confinement,
            SPEED: speed,
            SEEDS: len(group),
            "yielded [-]": int(group[YIELD].notna().sum()),
            **averaged(group, QUANTITIES),
        }
        rows.append(row)
    return pd.DataFrame(rows)
