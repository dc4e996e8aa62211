"""Do smarticles entangle as in the paper's simulation if their motors cannot give way?

Shape change and internal oscillation by the rules of the paper's own code (Savoie, Tuazon, Bhamla and Goldman, Soft
Matter 2023). Its motors prescribe the speed of a barb whatever the load, and only halve it or stop after many steps
beyond the torque limit. Here the shaft between motor and barb is a spring; the stiffer it is, the farther torques
exceed their limit before the motor reacts. The stiffest shaft yields less than the contacts and stands for that motor.
"""

import math

import numpy as np
import pandas as pd

from dem.record.run import Run
from dem.scene.reading import load_scene
from postprocess.statistics.points import ASPECT, SEED, pairs
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import Means, by_procedure
from studies.framework.findings import Effect, Finding, Rows, above, mean, slope
from studies.framework.procedures import (
    CROSSINGS,
    ENERGY,
    HEIGHT,
    INTERNAL,
    ORDER,
    PROCEDURE,
    SHAPE,
    activity,
    of_procedure,
    procedure_row,
)
from studies.framework.runs import ASPECT_KEY, Key, Row, declare
from studies.framework.study import Study

SHAFT, CONTACT, DECADES = "shaft stiffness [N m/rad]", "contact stiffness [N/m]", "log10 of the shaft's stiffness [-]"
TORQUE = "rms torque over the limit [-]"
RESIDUAL = "energy residual over work [-]"
SOFT_CONTACT = 500.0  # N/m

QUANTITIES = declare(
    {
        CROSSINGS: ("⟨N⟩", ".2f", "⟨N⟩ at rest: links of others through a smarticle's plane"),
        HEIGHT: ("h/h0", ".3f", "height of the centre of mass at rest after the activity, over that before it"),
        ENERGY: ("energy [J]", ".2e", "work of the motors on the smarticles, per smarticle"),
        TORQUE: ("τ/τ_max", ".2f", "root mean square torque of all motors in the activity, over their limit"),
        RESIDUAL: ("residual", ".1e", "largest residual of the energy ledger, over the work of all motors"),
    },
    axes={
        CROSSINGS: "$\\langle N\\rangle$ [-]",
        ENERGY: "energy per smarticle [J]",
        TORQUE: "rms torque over $\\tau_\\mathrm{max}$ [-]",
    },
)


def measure(run: Run) -> Row:
    """Measure the pile, the torques of the motors and the residual of the energy ledger; return the row."""
    row, scene, series = procedure_row(run), load_scene(run.path / "scene.yaml"), run.series
    active = series["phase"] == activity(run).index
    row |= {SHAFT: scene.motor.stiffness_N_m_per_rad, CONTACT: scene.fidelity.stiffness_N_per_m}
    row[DECADES] = math.log10(scene.motor.stiffness_N_m_per_rad)
    torque = np.sqrt(np.nanmean(np.square(series["motor_torque_N_m"][active])))
    row[TORQUE] = float(torque / scene.torque_limit)
    work = row[ENERGY]
    assert isinstance(work, float)
    row[RESIDUAL] = float(np.nanmax(np.abs(series["energy_residual_J"]))) / (work * run.manifest.count)
    return row


def _soft_contacts(table: pd.DataFrame) -> pd.DataFrame:
    return table[np.isclose(table[CONTACT], SOFT_CONTACT)]


def _with_shaft(stiffness: float) -> Rows:
    """Return a function that selects rows with soft contacts by the stiffness of the shaft [N m/rad]."""
    return lambda table: _soft_contacts(table[np.isclose(table[SHAFT], stiffness)])


def _of_shape(rows: Rows) -> Rows:
    """Return a function that selects those rows that `rows` selects and that have a shape change."""
    return lambda table: of_procedure(rows(table), SHAPE)


def _stiff_contacts_cost(table: pd.DataFrame) -> list[Effect]:
    """Compare the energies of a shape change with stiff and with soft contacts, for the stiffest shaft."""
    shape = of_procedure(table[table[SHAFT] == table[SHAFT].max()], SHAPE)
    both = pairs(shape[shape[CONTACT] > SOFT_CONTACT], _soft_contacts(shape), ENERGY)
    ratio = mean_over_seeds(np.log10(both["one"] / both["other"]))
    text = f"{10**ratio.value:.3g} ×/÷ {10**ratio.half_width:.3g} (n = {ratio.count})" if ratio.count > 1 else "no data"
    return [Effect(label="energy at 4000 N/m over that at 500 N/m, geometric mean and 95 %:", value=ratio, text=text)]


_ENDS = (
    ("soft", "soft shafts, 0.003 N m/rad", _with_shaft(3e-3)),
    ("rigid", "rigid motors, 3 N m/rad", _with_shaft(3.0)),
)  #: Softest and stiffest shaft: end of ids of findings, begin of statements, rows

FINDINGS = (
    slope(
        "stiffer-entangles-more",
        "(ours) ⟨N⟩ after shape change rises with the stiffness of the shaft",
        CROSSINGS,
        DECADES,
        within=(ASPECT, SEED),
        rows=_of_shape(_soft_contacts),
    ),
    *(
        finding
        for end, says, rows in _ENDS
        for finding in (
            above(f"shape-entangles-most-{end}", f"{says}: shape change entangles more than internal oscillation",
                  CROSSINGS, SHAPE, (INTERNAL,), rows=rows),
            slope(f"grows-with-aspect-{end}", f"{says}: ⟨N⟩ after shape change rises with l/w", CROSSINGS, ASPECT,
                  rows=_of_shape(rows)),
            mean(f"stays-up-{end}", f"{says}: the pile does not come back to h0 after a shape change",
                 lambda table: table[HEIGHT] - 1, "h/h0 − 1", rows=_of_shape(rows), shown=[HEIGHT], by=ASPECT),
            above(f"shape-costs-more-{end}", f"{says}: shape change needs more energy than internal oscillation",
                  ENERGY, SHAPE, (INTERNAL,), rows=rows),
        )
    ),
    Finding(
        id="costs-depend-on-contacts",
        says="(ours) With rigid motors the energy of a shape change rises with the stiffness of contacts",
        outcome=_stiff_contacts_cost,
    ),
)  # fmt: skip


def _against_shaft(name: str, column: str, *, log: bool = False) -> Means:
    return Means(
        name=name,
        quantities=[QUANTITIES[column]],
        x=SHAFT,
        x_label="stiffness of the shaft [N m/rad]",
        split=by_procedure(),
        rows=_soft_contacts,
        panels=ASPECT,
        log_x=True,
        log=log,
        share_y=True,
        notes=["Contacts of 500 N/m. The stiffest shaft stands for the motors of the paper's code."],
    )


STUDY = Study(
    name="shaft",
    title="Motors that give way, and motors that do not",
    measure=measure,
    keys=(
        Key(column=PROCEDURE, label="procedure", order=ORDER),
        Key(column=SHAFT, label="shaft", form="g"),
        Key(column=CONTACT, label="contacts", form="g"),
        ASPECT_KEY,
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=(
        _against_shaft("crossings_shaft", CROSSINGS),
        _against_shaft("energy_shaft", ENERGY, log=True),
        _against_shaft("torque_shaft", TORQUE, log=True),
    ),
    order=(PROCEDURE, ASPECT, SHAFT, CONTACT, SEED),
    one_engine=True,
    remarks=("⟨N⟩, heights and energy as in the study procedures.",),
    pictured={"procedure": SHAPE, "l_over_w": 1.0},
)
