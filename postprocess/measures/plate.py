"""Measure a compression by a plate: stress and strain, peak, work, stiffness of the first unloading.

The stress is the upward force of the pile on the plate over π R², with the container's radius R; a sample is the mean
over the time since the previous one. The strain is the downward displacement of the plate since the phase began, over
its height above the floor at that time.
"""

from dataclasses import dataclass

import numpy as np

from dem.record.run import Run
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.registry import PhaseMeasure, Quantity, Shown

COMPRESS = "compress"  #: Type of the phase
UNLOADED = (0.9, 0.5)  #: Fractions of the stress at the first reversal between which the unloading's slope is taken [-]


@dataclass(frozen=True, kw_only=True, eq=False)
class Compression:
    """Stress and strain of a compression at its n samples, while there is a plate."""

    times: Floats  #: (n,) times since the start of the run [s]
    strains: Floats  #: (n,) strains at these times [-]
    stresses: Floats  #: (n,) stresses, means since the sample before [Pa]
    start: float  #: Height of the plate above the floor when the phase began [m]
    area: float  #: Area of the plate [m²]

    @property
    def work(self) -> float:
        """Work of the plate on the pile, ∫ F dz [J]."""
        return float(self.area * self.start * (self.stresses @ np.diff(self.strains, prepend=0.0)))

    @property
    def unloading_modulus(self) -> float:
        """Slope of stress over strain in the first unloading, between `UNLOADED` [Pa]; NaN without unloading."""
        backward = np.flatnonzero(np.diff(self.strains) < 0)
        if not len(backward):
            return float("nan")
        turn = backward[0]
        loaded = np.flatnonzero(np.diff(self.strains[turn:]) > 0)
        leg = slice(turn, turn + (loaded[0] if len(loaded) else len(self.strains)) + 1)
        # A stress belongs to the middle of the time over which it was averaged.
        strains, stresses = np.convolve(self.strains[leg], [0.5, 0.5], mode="valid"), self.stresses[leg][1:]
        top = self.stresses[leg].max(initial=0.0)
        inside = (stresses <= UNLOADED[0] * top) & (stresses >= UNLOADED[1] * top)
        if inside.sum() < 2:
            return float("nan")
        return float(np.polyfit(strains[inside], stresses[inside], 1)[0])


def read_compression(run: Run, series: Series, phase: int) -> Compression:
    """Read stress and strain of the phase with the given index, as far as the run has come."""
    inside = series.known("plate_z_m", phase)
    height = series["plate_z_m"] - series["container_z_m"]
    area, times = float(np.pi * run.scene["container"]["radius_m"] ** 2), series.time[inside]
    speed, begun = run.scene["phases"][phase]["speed_m_per_s"], run.phases[phase].start_s or 0.0
    # The plate has come down at its speed until the first sample.
    start = float(height[inside[0]]) + speed * (float(times[0]) - begun)
    return Compression(
        times=times,
        strains=1 - height[inside] / start,
        stresses=series["plate_force_N"][inside, 2] / area,
        start=start,
        area=area,
    )


def has_plate(series: Series, phase: int) -> bool:
    """Return whether a series has at least two samples with a plate in the phase with this index."""
    return len(series.known("plate_z_m", phase)) >= 2


def _of_plate(run: Run, series: Series, phase: int) -> tuple[float, ...]:
    found = read_compression(run, series, phase)
    highest = int(found.stresses.argmax())
    return (
        float(found.stresses[highest]),
        float(found.strains[highest]),
        float(found.strains.max()),
        found.work,
        found.unloading_modulus,
    )


MEASURES = (
    PhaseMeasure(
        name="compression by a plate",
        phases=(COMPRESS,),
        quantities=(
            Quantity("plate peak stress", "Pa", Shown(heading="peak stress [Pa]", place=42, form=".3g")),
            Quantity("strain at the peak stress", "-", Shown(heading="strain at it", place=43, form=".3f")),
            Quantity("largest strain", "-"),
            Quantity("plate work", "J", Shown(heading="plate work [mJ]", place=44, form=".3g", factor=1e3)),
            Quantity("unloading modulus", "Pa"),
        ),
        take=_of_plate,
        available_for=has_plate,
    ),
)
