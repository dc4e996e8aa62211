"""Make figures with a common style, and write them to files.

A figure is drawn inside `style()`; `add_footer` adds its provenance, and `save` writes the files.
"""

import textwrap
import warnings
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from postprocess.report.tables import whole_file

with warnings.catch_warnings():
    # A system-wide mpl_toolkits may hide that of the environment; no figure here is three-dimensional.
    warnings.filterwarnings("ignore", message="Unable to import Axes3D")
    import matplotlib.figure
    import matplotlib.style

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import FillBetweenPolyCollection, LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from numpy.typing import NDArray

COLUMN_WIDTH = 3.5  #: Width of a journal column [inch]
RESOLUTION = 300  #: Resolution of bitmaps [dots per inch]

BLACK = "#1a1a1a"
BLUE = "#0072b2"
SKY = "#56b4e9"
ORANGE = "#d55e00"
GREEN = "#009e73"
GREY = "#6e6e6e"
"""The colours above are of Okabe and Ito: distinct with common colour blindness and in grey print."""

_STYLE: dict[Any, Any] = {
    "axes.edgecolor": BLACK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "errorbar.capsize": 2.0,
    "figure.dpi": RESOLUTION,
    "font.family": "DejaVu Sans",
    "font.size": 7.5,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.5,
    "legend.fontsize": 6.5,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "lines.linewidth": 1.1,
    "lines.markersize": 4.0,
    "mathtext.fontset": "dejavusans",
    "pdf.fonttype": 42,
    "savefig.dpi": RESOLUTION,
    "svg.fonttype": "none",
    "svg.hashsalt": "smarticles",
    "xtick.direction": "out",
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
}

_FOOTER_SIZE = 4.6
_FOOTER_LINE = 0.082  # height of a line of the footer [inch]
_FOOTER_MARGIN = 0.06  # space above and below the footer together [inch]
_FOOTER_COLUMNS = 97  # characters of the footer per `COLUMN_WIDTH`

FOOTER_SHARE = 0.2  #: Largest fraction of a figure's height that its footer takes [-]


def style() -> AbstractContextManager[None]:
    """Set Matplotlib's parameters for figures, and restore them afterwards."""
    return rc_context(_STYLE)


def new_figure(*, width: float = COLUMN_WIDTH, height: float = 2.6) -> tuple[Figure, Axes]:
    """Make a figure with one pair of axes, of a width and a height [inch].

    The height is that before `add_footer`, which enlarges the figure.
    """
    figure = blank_figure(width, height)
    return figure, figure.add_subplot()


def blank_figure(width: float, height: float) -> Figure:
    """Make a figure without axes, of a width and height [inch], which needs no display."""
    figure = matplotlib.figure.Figure(figsize=(width, height), dpi=RESOLUTION, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def add_footer(figure: Figure, lines: Sequence[str]) -> None:
    """Add a footer of `lines`, the provenance, to a finished figure, which grows by its height.

    The footer takes at most `FOOTER_SHARE` of the figure. A longer text is cut with "…" before its last statement,
    which names the file with the full text.
    """
    width, height = figure.get_size_inches()
    room = height * FOOTER_SHARE / (1 - FOOTER_SHARE) - _FOOTER_MARGIN
    text = _fitting(lines, int(_FOOTER_COLUMNS * width / COLUMN_WIDTH), max(int(room / _FOOTER_LINE), 1))
    below = _FOOTER_LINE * len(text) + _FOOTER_MARGIN
    figure.set_size_inches(width, height + below)
    base = below / (height + below)
    figure.set_layout_engine("constrained", rect=(0.0, base, 1.0, 1.0 - base))
    figure.text(
        0.015, _FOOTER_MARGIN / 2 / (height + below), "\n".join(text), fontsize=_FOOTER_SIZE, color=GREY,
        va="bottom", ha="left", linespacing=1.25, parse_math=False,
    )  # fmt: skip


def _fitting(lines: Sequence[str], columns: int, most: int) -> list[str]:
    """Wrap statements at `columns` characters; cut the text to `most` lines, but keep the last statement."""
    broken = [textwrap.wrap(line, columns, break_on_hyphens=False) or [""] for line in lines]
    text = [part for parts in broken for part in parts]
    if len(text) <= most:
        return text
    last = broken[-1][:most]
    kept = text[: most - len(last)]
    if kept:
        kept[-1] = f"{kept[-1][: columns - 2].rstrip()} …"
    return [*kept, *last]


def save(figure: Figure, path: Path, *, formats: Sequence[str] = ("png", "svg", "pdf")) -> list[Path]:
    """Write a figure to one file per format; return the paths: the given path with the format as suffix.

    The files contain no date, so that equal figures have equal bytes.
    """
    dates: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None, "ModDate": None}}
    written = []
    for suffix in formats:
        target = path.with_name(f"{path.name}.{suffix}")
        with whole_file(target) as temporary:
            figure.savefig(temporary, format=suffix, metadata=dates.get(suffix))
        written.append(target)
    return written


def sequence(colours: int, *, last: float = 1.0) -> list[str]:
    """Return `colours` hexadecimal colours of the map viridis, from dark to light.

    They are brightened so that shading is visible. `last` is the position of the last colour in the map; 1 is its end.
    """
    steps = [0.16 + (last - 0.16) * i / max(colours - 1, 1) for i in range(colours)]
    plain = np.array([matplotlib.colormaps["viridis"](step)[:3] for step in steps])
    return [to_hex(colour) for colour in 1 - 0.86 * (1 - plain)]


_MARGIN = 0.03  # space between the data and a widened limit, over the length of the axis


def hold_everything(figure: Figure) -> list[str]:
    """Widen the limits of axes that would cut lines, error bars or bands; call this before `add_footer`.

    A logarithmic axis cannot show values at or below 0, so error bars that reach there are cut. Returns statements for
    the footer about cut error bars.
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
    """Widen the limits of one axis, 0 for x or 1 for y."""
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
    """Return the points of all lines, error bars and bands in data coordinates: one array (n, 2) for each.

    `Axes.dataLim` does not suffice: for error bars it lacks the least end that is above 0.
    """
    lines = [line for line in axes.lines if line.get_transform() == axes.transData]
    bands = [band for band in axes.collections if isinstance(band, FillBetweenPolyCollection)]
    return [
        *(np.asarray(line.get_xydata(), dtype=np.float64) for line in lines),
        *_bars(axes),
        *(np.asarray(path.vertices, dtype=np.float64) for band in bands for path in band.get_paths()),
    ]


def _bars(axes: Axes) -> list[NDArray[np.float64]]:
    """Return the two ends (2, 2) of each error bar in data coordinates."""
    return [
        np.asarray(ends, dtype=np.float64)
        for bars in axes.collections
        if isinstance(bars, LineCollection)
        for ends in bars.get_segments()
        if len(ends)
    ]
