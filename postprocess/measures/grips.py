"""Measure pulls by grips: force against elongation between two grips, and what a grip picks up.

The pull is the force with which other bodies, floor and wall hold back the bodies of the moving grip. The pull on the
resting grip is their force on its bodies, in the direction in which the other grip moves; along z it includes the push
of the floor. The strain is the elongation over the distance between the grips at the beginning, each at the mean of the
centres of mass of its bodies. What a grip has picked up is the mass whose weight it bears, gripped bodies included; as
a number of bodies, it is divided by the mean mass of one. In runs that do not record the weight of gripped bodies, made
before the column `grip_moved_weight_N`, they count with the mean mass.
"""

from dataclasses import dataclass

import numpy as np

from dem.record.run import Run
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.pull import END, averaged, held_fast, interval_of, weight_of_one
from postprocess.measures.registry import PhaseMeasure, Quantity, Shown

TENSION, LIFT = "tension", "lift"  #: Types of phases


@dataclass(frozen=True, kw_only=True, eq=False)
class TensionTest:
    """Pull and elongation between two grips at n samples."""

    elongations: Floats  #: (n,) displacements of the moving grip [m]
    pulls: Floats  #: (n,) pull on the moving grip, mean since the sample before [N]
    held: Floats  #: (n,) pull on the grip that rests, mean since the sample before [N]
    length: float  #: Distance between the grips at the beginning [m]
    interval: float  #: Time between samples [s]

    @property
    def work(self) -> float:
        """Work of the pull, ∫ F dx [J]."""
        return float(self.pulls @ np.diff(self.elongations, prepend=0.0))


def read_tension(run: Run, series: Series, phase: int) -> TensionTest:
    """Read pull and elongation of the phase with the given index, as far as the run has come."""
    axis = "xyz".index(run.scene["phases"][phase]["axis"])
    inside = series.known("elongation_m", phase)
    elongations = series["elongation_m"][inside]
    # The first sample has no sample with the grips before it.
    return TensionTest(
        elongations=elongations,
        pulls=-np.nan_to_num(series["grip_moved_force_N"][inside, axis]),
        held=np.nan_to_num(series["grip_fixed_force_N"][inside, axis]),
        length=float(series["grip_distance_m"][inside[0]] - elongations[0]),
        interval=interval_of(series.time[inside]),
    )


def has_grips(series: Series, phase: int) -> bool:
    """Return whether a series has at least two samples with a grip in the phase with this index."""
    return len(series.known("elongation_m", phase)) >= 2


def _of_tension(run: Run, series: Series, phase: int) -> tuple[float, ...]:
    test, asked = read_tension(run, series, phase), run.scene["phases"][phase]
    whole = weight_of_one(run) * run.manifest.count
    means, places, held = (averaged(each, test.interval) for each in (test.pulls, test.elongations, test.held))
    highest = int(means.argmax())
    ended = run.phases[phase].end_s is not None
    return (
        float(means[highest]) / whole,
        float(places[highest]) / test.length,
        float(held[highest]) / whole,
        test.work,
        float(held_fast(test.elongations, asked)) if ended else float("nan"),
    )


def _of_lift(run: Run, series: Series, phase: int) -> tuple[float, ...]:
    inside = series.known("elongation_m", phase)
    inside = inside[np.isfinite(series["grip_moved_force_N"][inside, 2])]
    last = inside[series.time[inside] > series.time[inside[-1]] - END]
    gripped = float(series["grip_moved_count"][last[-1]])
    one, mass = weight_of_one(run), run.manifest.smarticle_mass_kg
    recorded = "grip_moved_weight_N" in series.data
    weight = float(series["grip_moved_weight_N"][last[-1]]) if recorded else gripped * one
    picked = (weight - float(series["grip_moved_force_N"][last, 2].mean())) / one
    return gripped, weight / one * mass, picked, picked * mass


MEASURES = (
    PhaseMeasure(
        name="tension between grips",
        phases=(TENSION,),
        quantities=(
            Quantity("peak pull over n W_s", "-", Shown(heading="peak F/nW", place=45, form=".3f")),
            Quantity("strain at the peak pull", "-", Shown(heading="strain at it", place=46, form=".3f")),
            Quantity(
                "pull on the resting grip at the peak over n W_s",
                "-",
                Shown(heading="resting F/nW", place=45, form=".3f"),
            ),
            Quantity("work of the pull", "J", Shown(heading="work of the pull [mJ]", place=47, form=".3g", factor=1e3)),
            Quantity("pull held fast", "-"),
        ),
        take=_of_tension,
        available_for=has_grips,
    ),
    PhaseMeasure(
        name="pick-up by a grip",
        phases=(LIFT,),
        quantities=(
            Quantity("gripped", "smarticles"),
            Quantity("gripped mass", "kg"),
            Quantity("picked up", "smarticles", Shown(heading="picked up", place=48, form=".1f")),
            Quantity("picked up mass", "kg", Shown(heading="picked up [kg]", place=48, form=".3g")),
        ),
        take=_of_lift,
        available_for=has_grips,
    ),
)
