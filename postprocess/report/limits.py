"""Widen limits of axes so that they hide nothing: every error bar, band and line that was drawn lies within them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import FillBetweenPolyCollection, LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

_MARGIN = 0.03  # of the axis, beyond what would be cut: what ends at the frame looks cut


def hold_everything(figure: Figure) -> list[str]:
    """Widen limits that cut what was drawn, of a figure drawn completely but for its footer.

    On a logarithmic axis nothing at or below 0 has a place: bars that reach there end at the axis, which is stated.

    Returns:
        What could not be shown whole, one statement each, for the footer.
    """
    cut = 0
    for axes in figure.axes:
        for place, scale in enumerate((axes.get_xscale(), axes.get_yscale())):
            _hold(axes, place, log=scale == "log")
            cut += scale == "log" and sum(float(ends[:, place].min()) <= 0 for ends in _bars(axes))
    if not cut:
        return []
    return [f"{cut} error bar{'s' if cut > 1 else ''} reach{'' if cut > 1 else 'es'} to 0 or below: cut by the axis."]


def _hold(axes: Axes, place: int, *, log: bool) -> None:
    """Widen one axis, x (0) or y (1)."""
    values = np.concatenate([np.empty(0), *(points[:, place] for points in _drawn(axes))])
    values = values[np.isfinite(values) & ((values > 0) if log else True)]
    if not len(values):
        return
    limits = axes.get_ylim() if place else axes.get_xlim()
    least, most = min(limits), max(limits)
    low, high = min(least, float(values.min())), max(most, float(values.max()))
    if (low, high) == (least, most):
        return
    ends = np.log10([low, high]) if log else np.array([low, high])
    ends += _MARGIN * (ends[1] - ends[0]) * np.array([-1.0 if low < least else 0.0, 1.0 if high > most else 0.0])
    wider = [float(end) for end in (10**ends if log else ends)]
    (axes.set_ylim if place else axes.set_xlim)(*(wider[::-1] if limits[0] > limits[1] else wider))


def _drawn(axes: Axes) -> list[NDArray[np.float64]]:
    """Return points (n, 2) of lines, error bars and bands that stand in coordinates of the data.

    Not `Axes.dataLim`: of error bars it knows the corners of them all together, not the least that is above 0.
    """
    lines = [line for line in axes.lines if line.get_transform() == axes.transData]
    bands = [band for band in axes.collections if isinstance(band, FillBetweenPolyCollection)]
    return [
        *(np.asarray(line.get_xydata(), dtype=np.float64) for line in lines),
        *_bars(axes),
        *(np.asarray(path.vertices, dtype=np.float64) for band in bands for path in band.get_paths()),
    ]


def _bars(axes: Axes) -> list[NDArray[np.float64]]:
    """Return ends (n, 2) of error bars."""
    return [
        np.asarray(ends, dtype=np.float64)
        for bars in axes.collections
        if isinstance(bars, LineCollection)
        for ends in bars.get_segments()
        if len(ends)
    ]
