"""The barrier that keeps axes apart, and the sub-steps that resolve it.

A contact's energy is kn/2 u(δ)², with the overlap δ and the stretched overlap u. The room is the overlap at which the
axes of two links, or an axis and a surface, would meet. Up to a quarter of the room u = δ, so that ordinary contacts
are linear. Beyond a quarter u grows without bound as δ approaches the room:

    u = δ + room x³ / (1 - x),   x = (δ - room/4) / (3/4 room),

which has two continuous derivatives. The force is kn u u', the stiffness kn h² with h² = u'² + u u''. Dashpots are
scaled by the hardening h, which keeps the damping ratio and the restitution constant (Tsuji et al., Powder Technol. 71,
239 (1992)). No load can push axes through each other, as in incremental potential contact (Li et al., ACM Trans. Graph.
39, 49 (2020)); the logarithm of that method is replaced by a rational function, which joins a linear spring.

Time steps are stable for the linear spring. A step is divided into sub-steps if a contact is stiffer than this spring
or closes fast.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dem.engine.links.arrays import Array
from dem.engine.links.compiler import inlined, part

LINEAR = 0.25  # of the room, up to which a contact is linear
LAST = 0.95  # x from which on u follows its tangent, so that a pile that is taken over has finite forces
APPROACH = 0.25  # of the room that is left, which a contact may close in a sub-step
STRIDE, LONGEST = 0.25, 0.5  # radii that a link moves in a sub-step, and from which on a step is divided
FINEST = 1024  # sub-steps of a step, a power of two
SLACK = 1.2  # factor by which sub-steps may be longer than needed, since a step is a tenth shorter than the stable one


class Step(NamedTuple):
    """Times at an evaluation of forces, and the number of sub-steps that these forces need.

    Forces act during the next sub-step, whose length follows from `need`.
    """

    past: float  #: Time since the last evaluation, over which tangential springs have stretched [s]
    whole: float  #: Length of an undivided time step [s]
    need: Array  #: (1,) number of sub-steps per time step that contacts and speeds need; kernels increase it


@inlined
def stretch(depth: float, room: float) -> tuple[float, float, float]:
    """Return the stretched overlap u [m], its derivative u' = du/dδ [1] and the hardening h [1].

    The energy of a contact is kn/2 u², the force of its spring kn u u'; its dashpots are multiplied by h.

    Args:
        depth: overlap δ [m].
        room: overlap at which axes meet [m].
    """
    begin = LINEAR * room
    u, slope, hardening = depth, 1.0, 1.0
    if depth > begin:
        rest = room - begin
        x = (depth - begin) / rest
        beyond = 0.0
        if x > LAST:
            beyond, x = (x - LAST) * rest, LAST
        far = 1.0 / (1.0 - x)
        slope = 1.0 + room / rest * x * x * (3.0 - 2.0 * x) * far * far
        u = begin + x * rest + room * x * x * x * far + slope * beyond
        bend = room / (rest * rest) * x * (6.0 - 6.0 * x + 2.0 * x * x) * far * far * far
        hardening = math.sqrt(slope * slope + u * bend)
    return u, slope, hardening


@part
def _demand(depth: float, room: float, closing: float, whole: float) -> float:
    """Return the number of sub-steps per time step that a contact beyond the linear range needs.

    The spring is linear up to an overlap of `LINEAR` times `room`.

    Args:
        depth: overlap [m].
        room: overlap at which axes meet [m].
        closing: rate at which the overlap grows [m/s].
        whole: length of an undivided time step [s].
    """
    left = max(room - depth, 1e-6 * room)
    ahead = min(depth + max(0.0, min(whole * closing, APPROACH * left)), room)
    _, _, hardening = stretch(ahead, room)
    # Twice as many as stability needs: where forces are far from linear, energy is kept less well.
    return max(2.0 * hardening - 1.0, whole * closing / (APPROACH * left))


@inlined
def resolve(step: Step, depth: float, room: float, closing: float) -> None:
    """Increase `step.need` if a contact is beyond the linear range, or gets there within a time step.

    The spring is linear up to an overlap of `LINEAR` times `room`.

    Args:
        step: `need` is increased.
        depth: overlap [m].
        room: overlap at which axes meet [m].
        closing: rate at which the overlap grows [m/s].
    """
    if depth + step.whole * max(0.0, closing) > LINEAR * room:
        step.need[0] = max(step.need[0], _demand(depth, room, closing, step.whole))


@inlined
def ticks_for(need: float, tick: int) -> int:
    """Return the length of the next sub-step in ticks; a time step has `FINEST` ticks.

    Args:
        need: number of sub-steps per time step, as `Step.need`.
        tick: ticks of the step that have passed; sub-steps begin at multiples of their own length.
    """
    ticks = FINEST
    while ticks > 1 and (ticks * need > SLACK * FINEST or tick % ticks != 0):
        ticks //= 2
    return ticks
