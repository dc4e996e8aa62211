"""How measures say no."""

from __future__ import annotations

from dem.errors import InputError


class UndefinedMeasureError(InputError):
    """The measure has no meaning for this frame, e.g. a packing fraction of one smarticle.

    Tables over whole runs show such values as NaN; every other error stops them.
    """
