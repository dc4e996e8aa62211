"""Forces at contacts: what a run records of an engine where its scene asks for it.

Engines touch at points: spheres of a chain, or the ends of a stretch over which two links lie on each other. A contact
is all points of one pair of links, or of a link and a boundary, taken together, which no engine has more or fewer of.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dem.body.particle import LINKS

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
Number = TypeVar("Number", int, Numbers)

BOUNDARIES = ("floor", "wall", "lower hook", "upper hook", "channel's lower wall", "channel's upper wall")
"""What does not give way, by the number that it has in what is recorded."""
FLOOR, WALL, LOWER_HOOK, UPPER_HOOK, CHANNEL = range(5)  # the channel has two
NONE = -1


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactForces:
    """All contacts at one instant that carry a force.

    Args:
        smarticles: (M, 2) the two smarticles, the lower number first; the second one is -1 for a boundary.
        links: (M, 2) their links: 0 barb 1, 1 middle link, 2 barb 2; -1 for a boundary.
        boundaries: (M,) place in `BOUNDARIES`; -1 between smarticles.
        points: (M, 3) where the force acts: the mean of the points of contact, weighted by their normal forces [m].
        normal: (M,) sum of the normal forces at the points, positive [N].
        tangential: (M,) size of the sum of the tangential forces at the points [N].
        forces: (M, 3) on the first one, the sum over all points [N].
    """

    smarticles: Numbers
    links: Numbers
    boundaries: Numbers
    points: Array
    normal: Array
    tangential: Array
    forces: Array


def at_links(smarticle: Number, link: Number) -> Number:
    """What `contacts_of_points` calls links of smarticles."""
    return LINKS * smarticle + link


def at_boundaries(part: Number) -> Number:
    """What `contacts_of_points` calls boundaries, which are places in `BOUNDARIES`."""
    return -1 - part


def contacts_of_points(
    first: Numbers, second: Numbers, *, loads: Array, points: Array, friction: Array, forces: Array
) -> ContactForces:
    """Contacts of the points at which bodies touch.

    Args:
        first: (P,) what touches: see `at_links`; never a boundary.
        second: (P,) what is touched: see `at_links` and `at_boundaries`.
        loads: (P,) normal force of each point, not negative [N]; a contact without any is left out.
        points: (P, 3) where they are [m].
        friction: (P, 3) tangential force of each [N], on the first one, as `forces`.
        forces: (P, 3) on the first one, all together [N].
    """
    turned = (second >= 0) & (second < first)
    sign = np.where(turned, -1.0, 1.0)[:, None]
    pairs = np.column_stack([np.where(turned, second, first), np.where(turned, first, second)])
    which, number = np.unique(pairs, axis=0, return_inverse=True)
    number = number.reshape(-1)

    def added(values: Array) -> Array:
        total = np.zeros((len(which), *values.shape[1:]))
        np.add.at(total, number, values)
        return total

    total = added(loads)
    carried = total > 0
    pairs, loose = which[carried].astype(np.int64), which[carried, 1] < 0
    return ContactForces(
        smarticles=np.where(np.column_stack([np.zeros_like(loose), loose]), NONE, pairs // LINKS),
        links=np.where(np.column_stack([np.zeros_like(loose), loose]), NONE, pairs % LINKS),
        boundaries=np.where(loose, -1 - pairs[:, 1], NONE),
        points=added(loads[:, None] * points)[carried] / total[carried, None],
        normal=total[carried],
        tangential=np.linalg.norm(added(sign * friction)[carried], axis=1),
        forces=added(sign * forces)[carried],
    )
