"""Forces at contacts, for output.

In engines bodies touch at points: spheres of a chain, or the ends of a stretch over which two links lie on each other.
A contact is all points of one pair of links, or of a link and a boundary, so that its number does not depend on the
engine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.particle import LINKS

Number = TypeVar("Number", int, Numbers)

BOUNDARIES = ("floor", "wall", "lower hook", "upper hook", "channel's lower wall", "channel's upper wall")
"""Rigid boundaries, by their numbers in recorded files."""
FLOOR, WALL, LOWER_HOOK, UPPER_HOOK, CHANNEL = range(5)  # the channel has two
NONE = -1


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactForces:
    """All contacts at one instant that carry a force."""

    smarticles: Numbers  #: (M, 2) the two smarticles, the lower number first; the second one is -1 for a boundary
    links: Numbers  #: (M, 2) their links: 0 barb 1, 1 middle link, 2 barb 2; -1 for a boundary
    boundaries: Numbers  #: (M,) place in `BOUNDARIES`; -1 between smarticles
    points: Array  #: (M, 3) mean of the points of contact, weighted by their normal forces [m]
    normal: Array  #: (M,) sum of the normal forces at the points, positive [N]
    tangential: Array  #: (M,) size of the sum of the tangential forces at the points [N]
    forces: Array  #: (M, 3) on the first one, the sum over all points [N]


def at_links(smarticle: Number, link: Number) -> Number:
    """Return the numbers of links in `contacts_of_points`."""
    return LINKS * smarticle + link


def at_boundaries(part: Number) -> Number:
    """Return the numbers of boundaries, places in `BOUNDARIES`, in `contacts_of_points`."""
    return -1 - part


def contacts_of_points(
    first: Numbers, second: Numbers, *, loads: Array, points: Array, friction: Array, forces: Array
) -> ContactForces:
    """Join the points at which bodies touch into contacts.

    Args:
        first: (P,) bodies that touch: see `at_links`; never a boundary.
        second: (P,) bodies that are touched: see `at_links` and `at_boundaries`.
        loads: (P,) normal force of each point, not negative [N]; a contact without any is left out.
        points: (P, 3) [m].
        friction: (P, 3) tangential force of each on the first body [N].
        forces: (P, 3) whole force on the first body [N].
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
    missing = np.column_stack([np.zeros_like(loose), loose])
    return ContactForces(
        smarticles=np.where(missing, NONE, pairs // LINKS),
        links=np.where(missing, NONE, pairs % LINKS),
        boundaries=np.where(loose, -1 - pairs[:, 1], NONE),
        points=added(loads[:, None] * points)[carried] / total[carried, None],
        normal=total[carried],
        tangential=np.linalg.norm(added(sign * friction)[carried], axis=1),
        forces=added(sign * forces)[carried],
    )
