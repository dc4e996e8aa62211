"""Forces at contacts, for output.

Engines compute forces at points: where two spheres touch, or at both ends of the stretch over which two links lie on
each other. Here all points of one pair of links, or of one link and one boundary, make one contact, so that the number
of contacts does not depend on the engine.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.particle import LINKS

Number = TypeVar("Number", int, Numbers)

BOUNDARIES = ("floor", "wall", "lower hook", "upper hook", "channel's lower wall", "channel's upper wall", "plate")
"""Names of the rigid boundaries; recorded files hold indices of this tuple."""
FLOOR, WALL, LOWER_HOOK, UPPER_HOOK, CHANNEL = range(5)  # indices of `BOUNDARIES`; CHANNEL: the first of two walls
NONE = -1


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactForces:
    """The M contacts that carry a force at one instant."""

    smarticles: Numbers  #: (M, 2) the two smarticles, the lower number first; the second one is -1 for a boundary
    links: Numbers  #: (M, 2) links in contact: 0 barb 1, 1 middle link, 2 barb 2; -1 for a boundary
    boundaries: Numbers  #: (M,) index of the boundary in `BOUNDARIES`; -1 for a contact between smarticles
    points: Array  #: (M, 3) mean of the points of contact, weighted by their normal forces [m]
    normal: Array  #: (M,) sum of the normal forces at the points, positive [N]
    tangential: Array  #: (M,) magnitude of the vector sum of the tangential forces at the points [N]
    forces: Array  #: (M, 3) total force on the first smarticle, summed over the points [N]


def at_links(smarticle: Number, link: Number, each: int = LINKS) -> Number:
    """Return codes of links, 0 or above, for `contacts_of_points`.

    Links are given by their body and their number in it; no body has more than `each`. A code is `each` × body + link.
    """
    return each * smarticle + link


def at_boundaries(part: Number) -> Number:
    """Return codes of boundaries, below 0, for `contacts_of_points`; `part`: indices of `BOUNDARIES`."""
    return -1 - part


def contacts_of_points(
    first: Numbers,
    second: Numbers,
    *,
    loads: Array,
    points: Array,
    friction: Array,
    forces: Array,
    each: int = LINKS,
) -> ContactForces:
    """Return the contacts that P points make: one per pair of links, or of a link and a boundary.

    Args:
        first: (P,) codes of links, from `at_links`.
        second: (P,) codes of the links or boundaries that touch the links of `first`, from `at_links` and
            `at_boundaries`.
        loads: (P,) normal forces, 0 or above [N]; a contact whose points all have 0 is left out.
        friction: (P, 3) tangential forces on the links of `first` [N].
        forces: (P, 3) total forces on the links of `first` [N].
    """
    turned = (second >= 0) & (second < first)
    sign = np.where(turned, -1.0, 1.0)[:, None]
    pairs = np.column_stack([np.where(turned, second, first), np.where(turned, first, second)])
    which, number = np.unique(pairs, axis=0, return_inverse=True)
    number = number.reshape(-1)

    def summed(values: Array) -> Array:
        total = np.zeros((len(which), *values.shape[1:]))
        np.add.at(total, number, values)
        return total

    total = summed(loads)
    carried = total > 0
    pairs, loose = which[carried].astype(np.int64), which[carried, 1] < 0
    missing = np.column_stack([np.zeros_like(loose), loose])
    return ContactForces(
        smarticles=np.where(missing, NONE, pairs // each),
        links=np.where(missing, NONE, pairs % each),
        boundaries=np.where(loose, -1 - pairs[:, 1], NONE),
        points=summed(loads[:, None] * points)[carried] / total[carried, None],
        normal=total[carried],
        tangential=np.linalg.norm(summed(sign * friction)[carried], axis=1),
        forces=summed(sign * forces)[carried],
    )
