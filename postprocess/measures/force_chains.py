"""Measure how contacts share the load in runs that record forces (`recording.contact_forces`).

All points at which two links touch count as one contact; contacts with floor, wall and hooks are left out. A contact is
strong if its normal force exceeds the mean of the frame. Smarticles joined by strong contacts form force chains, which
carry the stress of granular matter (Radjai, Jean, Moreau & Roux, Phys. Rev. Lett. 77, 274 (1996); Radjai, Wolf, Jean &
Moreau, Phys. Rev. Lett. 80, 61 (1998)).

The participation of the forces is 1 / (M Σ q²) with q = f / Σ f: 1 if all M contacts carry equal forces, 1/M if one
carries the whole load (Makse, Johnson & Schwartz, Phys. Rev. Lett. 84, 4160 (2000)). Of forces distributed as
exp(-f/⟨f⟩), the fraction e⁻¹ = 0.37 is strong and carries 2/e = 0.74 of the load; the participation is 0.5.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from dem.record.forces import RecordedForces, read_forces
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Flags, Floats, UndefinedMeasureError
from postprocess.measures.clusters import Clusters, joined_clusters
from postprocess.measures.registry import FrameMeasure, Quantity


def checked_forces(normal: ArrayLike) -> Floats:
    """Return normal forces as a float64 array (M,) [N] after checking them.

    InputError unless they are (M,) finite numbers above 0; UndefinedMeasureError if there is no force.
    """
    normal = np.asarray(normal, dtype=np.float64)
    if normal.ndim != 1 or not np.all(np.isfinite(normal)) or np.any(normal <= 0):
        raise InputError(f"normal forces must be (M,) finite numbers above 0 N: got an array of shape {normal.shape}")
    if len(normal) == 0:
        raise UndefinedMeasureError("force chains need at least 1 contact that carries a force: got 0")
    return normal


def strong_contacts(normal: ArrayLike) -> Flags:
    """Return which of M contacts are strong, (M,) bool: those with a normal force (M,) [N] above the mean.

    Raises:
        InputError: Not (M,) finite numbers above 0.
        UndefinedMeasureError: There is no contact.

    Source:
        Radjai et al., Phys. Rev. Lett. 80, 61 (1998).

    Example:
        >>> strong_contacts([1.0, 2.0, 6.0]).tolist()
        [False, False, True]
    """
    normal = checked_forces(normal)
    strong: Flags = normal > normal.mean()
    return strong


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceDistribution:
    """Probability density P(f/⟨f⟩) of normal forces f at contacts in B intervals."""

    edges: Floats = field(repr=False)  #: (B + 1,) edges of the intervals of f/⟨f⟩ [-]
    density: Floats = field(repr=False)  #: (B,) probability density [-]
    mean_N: float  #: Mean force ⟨f⟩ [N]  # noqa: N815 - the unit
    count: int  #: Number of forces


def force_distribution(
    forces: ArrayLike | RecordedForces, *, bins: int = 32, largest: float = 8.0
) -> ForceDistribution:
    """Compute the probability density of normal forces over their mean.

    Args:
        forces: (M,) normal forces [N]; or the recorded forces of a frame, such as `run.forces[-1]`, of which those
            between bodies count.
        bins: Number of intervals, of equal width.
        largest: Largest force, over the mean [-]; larger ones count for mean and density and are in no interval.

    Raises:
        InputError: Forces are not finite numbers above 0, or `bins` or `largest` are not above 0.
        UndefinedMeasureError: There is no force.

    Example:
        >>> force_distribution([1.0, 1.0, 1.0, 5.0], bins=2, largest=4.0).density.tolist()
        [0.375, 0.125]
    """
    normal = checked_forces(forces.contacts.normal[forces.between] if isinstance(forces, RecordedForces) else forces)
    if not (bins >= 1 and 0 < largest < math.inf):
        raise InputError(f"intervals: got {bins} up to {largest:g} of the mean; give 1 or more, up to a number above 0")
    found, edges = np.histogram(normal / normal.mean(), bins=bins, range=(0.0, largest))
    return ForceDistribution(
        edges=edges, density=found / (len(normal) * np.diff(edges)), mean_N=float(normal.mean()), count=len(normal)
    )


def force_participation(normal: ArrayLike) -> float:
    """Compute the participation [-] of M contacts by their normal forces (M,) [N].

    It is 1 if all contacts carry equal forces, 1/M if one carries the whole load.

    Raises:
        InputError: Not (M,) finite numbers above 0.
        UndefinedMeasureError: There is no contact.

    Source:
        Makse, Johnson & Schwartz, Phys. Rev. Lett. 84, 4160 (2000).

    Example:
        >>> force_participation([2.0, 2.0]), round(force_participation([1e-9, 1.0]), 6)
        (1.0, 0.5)
    """
    normal = checked_forces(normal)
    return float(normal.sum() ** 2 / (len(normal) * (normal**2).sum()))


def force_chains(frame: Frame, forces: RecordedForces | None = None) -> Clusters:
    """Find clusters of smarticles joined by strong contacts, see `strong_contacts`.

    Only contacts between smarticles count, also in the mean force. Every smarticle is in a cluster, but a cluster of
    one is no force chain. If `forces` is None, the forces recorded with the frame are read from its run directory.

    Raises:
        InputError: The run recorded no forces, or their file is damaged.
        UndefinedMeasureError: There is no smarticle, or no smarticle touches another.
    """
    forces = read_forces(frame) if forces is None else forces
    between = forces.between
    pairs = forces.contacts.smarticles[between][strong_contacts(forces.contacts.normal[between])]
    return joined_clusters(frame.count, pairs[:, 0], pairs[:, 1])


def _taken_of(frame: Frame, _: Run) -> tuple[float, ...]:
    forces = read_forces(frame)
    between = forces.between
    normal, tangential = forces.contacts.normal[between], forces.contacts.tangential[between]
    if not len(normal):
        return (0.0, *(math.nan,) * 6)
    strong = strong_contacts(normal)
    return (
        float(len(normal)),
        float(normal.mean()),
        float(tangential.sum() / normal.sum()),
        float(strong.mean()),
        float(normal[strong].sum() / normal.sum()),
        force_participation(normal),
        force_chains(frame, forces).largest,
    )


MEASURES = (
    FrameMeasure(
        name="force chains",
        place=58,
        quantities=(
            Quantity("force contacts", "-"),
            Quantity("normal force mean", "N"),
            Quantity("tangential over normal force", "-"),
            Quantity("strong contacts", "-"),
            Quantity("strong share of force", "-"),
            Quantity("force participation", "-"),
            Quantity("force chain largest share", "-"),
        ),
        take=_taken_of,
        available_for=lambda run: run.forces is not None,
    ),
)
