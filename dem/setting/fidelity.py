"""Numerical parameters that trade accuracy for cost, and named sets of their values."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from dem.setting.part import Length, Part, Stiffness

MOST_ROWS = 32  # pairs of strands then cost 28 times as much as with two, see `dem.engine.links.cost`


class Fidelity(Part):
    """Numerical parameters that trade accuracy for cost; none of them changes mass or inertia."""

    base: Literal["draft", "standard", "reference"] = Field(
        "standard", description="named fidelity that gives the default of all other parameters"
    )
    rows: int = Field(
        ...,
        ge=1,
        le=MOST_ROWS,
        description="rows of spheres, or strands, across t1, the thickness along the normal [1]; the default of "
        "standard and reference leaves no hole for the thinnest body",
    )
    diameter_m: Length | None = Field(
        None,
        description="sphere diameter [m]; default with one row: such that two crossing chains touch at the mean "
        "distance of two bars of the true section, 2(t1+t2)/π; with several rows: t2",
    )
    pitch: float = Field(
        ...,
        ge=0.01,
        le=1.4,
        description="largest distance of neighbouring spheres over their diameter [1]; "
        "from √2 on chains pass through each other",
    )
    stiffness_N_per_m: Stiffness = Field(..., description="normal stiffness kn of one contact [N/m]")
    time_step_fraction: float = Field(
        ...,
        ge=1e-4,
        le=1,
        description="time step over the stable one, which is computed from masses and stiffness [1]",
    )
    time_step_s: float | None = Field(
        None,
        ge=1e-12,
        le=1,
        description="time step [s]; rejected above the stable one; default: time_step_fraction of the stable one",
    )
    wall_facets: int = Field(64, ge=16, le=512, description="flat facets around the cylinder's wall [1]")
    control_interval_s: float = Field(
        ...,
        ge=1e-9,
        le=1,
        description="time between two control updates of the motors [s]; the paper's time step is 2e-4 s",
    )
    hinge_stiffness_N_per_m: Stiffness = Field(
        ..., description="stiffness of the pin that holds the two links of a hinge together [N/m]"
    )


# The pin of standard and reference gives way by 1 % of a sphere's diameter under a pull of 100 times a smarticle's
# weight, up to l/w = 1. The softer pin of draft allows longer time steps, and gives way by 1 % in an actuated pile.
_STANDARD = {
    "rows": 1,
    "pitch": 1.0,
    "stiffness_N_per_m": 500.0,
    "time_step_fraction": 0.9,
    "control_interval_s": 2e-4,
    "hinge_stiffness_N_per_m": 14500.0,
}
FIDELITIES: Mapping[str, Mapping[str, Any]] = {
    "draft": {**_STANDARD, "pitch": 1.3, "stiffness_N_per_m": 250.0, "hinge_stiffness_N_per_m": 5000.0},
    "standard": _STANDARD,
    "reference": {**_STANDARD, "rows": 2},
}

# For the engine links, from results/accuracy-links; it ignores pitch and hinge stiffness. Its stable step is safe
# (results/stability); at l/w = 0.7 the fraction 0.92 gives two steps per control period, where 0.9 gives three.
_LINKS = {**_STANDARD, "time_step_fraction": 0.92}
_BY_ENGINE: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "links": {
        "draft": _LINKS,
        "standard": {**_LINKS, "rows": 2, "stiffness_N_per_m": 1000.0},
        "reference": {**_LINKS, "rows": 3, "stiffness_N_per_m": 2000.0},
    }
}


def fidelities(engine: str) -> Mapping[str, Mapping[str, Any]]:
    """Return an engine's named fidelities from coarse to fine: by name, the values of `Fidelity`'s keys.

    An unknown engine gets the fidelities for YADE.
    """
    return _BY_ENGINE.get(engine, FIDELITIES)
