"""Which difference between the paper's text and its own code changes the pile after a shape change.

A full factorial of the three differences that act on a shape change: the motor's law at its torque limit, friction,
and the radius of the wall. The main effect of each is the mean of paired differences, code less text, over aspect
ratios, seeds and all combinations of the other two.
"""

from itertools import product

import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED, paired_differences
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import Rows, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, means_by
from studies.framework.procedures import CROSSINGS, ENERGY, HEIGHT, PHI_ACTIVE, PROCEDURE, SHAPE, procedure_row
from studies.framework.runs import ASPECT_KEY, Key, Row, declare
from studies.framework.study import Study

LAW, FRICTION, RADIUS = "law", "friction [-]", "wall radius [m]"
FACTORS: dict[str, tuple[object, object]] = {LAW: ("halt", "ease"), FRICTION: (0.4, 0.2), RADIUS: (0.0234, 0.0224)}
"""Value of each factor in the paper's text, and in its code."""

NAMES = {
    LAW: ("law", "the motor's law (half speed, for a halt)"),
    FRICTION: ("friction", "friction (0.2, for 0.4)"),
    RADIUS: ("radius", "the wall's radius (22.4 mm, for 23.4)"),
}
QUANTITIES = declare(
    {
        CROSSINGS: ("⟨N⟩", ".2f", "⟨N⟩ at rest after the shape change"),
        HEIGHT: ("h/h0", ".3f", "height of the centre of mass at rest after it, over that before"),
        PHI_ACTIVE: ("φ_f", ".4f", "packing fraction over the last frames of the activity"),
        ENERGY: ("energy [J]", ".2e", "work of the motors"),
    },
    axes={CROSSINGS: r"$\langle N \rangle$ after the shape change [-]", HEIGHT: r"height over $h_0$ after it [-]"},
)
SIGNS = {CROSSINGS: ("⟨N⟩", 1), HEIGHT: ("h/h0", 1), PHI_ACTIVE: ("φ_f", -1), ENERGY: ("energy per smarticle [J]", 1)}


def measure(run: Run) -> Row:
    """Measure the shape change, and read the three factors from the scene; return the run's row."""
    row = procedure_row(run)
    if row[PROCEDURE] != SHAPE:
        raise InputError(f"{run.path}: its activity is {row[PROCEDURE]}, not a shape change; leave the run out")
    scene = run.scene
    motor, contact = scene.get("motor"), scene.get("contact")
    return {
        LAW: str(motor["law"]) if motor else "",
        FRICTION: contact["friction_smarticle"] if contact else float("nan"),
        RADIUS: run.manifest.container_radius_m,
        **row,
    }


def effect(quantity: str, factor: str) -> Finding:
    """Make the finding that a factor raises (sign +1 in `SIGNS`) or lowers (−1) a quantity.

    The effect is the mean difference between runs with the factor's value of the paper's code and those with that of
    its text, see `FACTORS`.
    """
    (symbol, sign), (name, text) = SIGNS[quantity], NAMES[factor]

    def outcome(runs: pd.DataFrame) -> Outcome:
        others = [name for name in (*FACTORS, ASPECT, SEED) if name != factor]
        found = paired_differences(runs, quantity, factor, FACTORS[factor], others)
        value = mean_over_seeds(found[quantity])
        note = f"by l/w {means_by(found, quantity, ASPECT, '+.3g')}"
        return Outcome(effects=[Effect(label="code less text", value=value, sign=sign)], note=note)

    return Finding(
        id=f"{quantity.split(maxsplit=1)[0]}-{name}",
        says=f"(ours) {symbol} after a shape change is {'raised' if sign > 0 else 'lowered'} by {text}",
        outcome=outcome,
    )


STUDY = Study(
    name="factors",
    title="What the paper's text and its own code differ in, one by one: shape change",
    measure=measure,
    keys=(
        Key(column=LAW, label="law"),
        Key(column=FRICTION, label="friction", form="g"),
        Key(column=RADIUS, label="wall [mm]", form=".1f", scale=1e3),
        ASPECT_KEY,
    ),
    quantities=tuple(QUANTITIES.values()),
    findings=tuple(effect(quantity, factor) for quantity, factor in product(SIGNS, FACTORS)),
    figures=(
        Rows(
            name="factors",
            quantities=[QUANTITIES[CROSSINGS], QUANTITIES[HEIGHT]],
            row=lambda point: f"{point[LAW]}, μ = {point[FRICTION]:g}, r = {1e3 * point[RADIUS]:.1f} mm",
            split=one_by_one(ASPECT, "l/w = {:g}".format),
        ),
    ),
    order=(*FACTORS, ASPECT, SEED),
    one_engine=True,
    from_tables=True,
    remarks=(
        "Effect of a difference: mean of paired differences, code less text, over l/w, seeds and all combinations of "
        "the other two; pairs begin with piles of the same random poses.",
    ),
    pictured={"protocol": "code", "law": "ease", "friction": 0.2, "l_over_w": 0.7},
)
