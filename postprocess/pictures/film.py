"""Choose the frames and the speed of films, and write films to files."""

import importlib
import io
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from scipy.spatial import cKDTree

from dem.errors import InputError
from postprocess.geometry.links import Floats

KINDS = (".gif", ".webp", ".mp4")  #: Suffixes of films
MOST = 150  #: Largest number of pictures of a film by default
RATE = 15.0  #: Default rate of a film [pictures/s]

_SAMPLED = 6  # pictures from which the colours of a film are chosen
_DIGITS = np.array([65536, 256, 1])  # to write red, green and blue as one number
_EXACT = 64  # the commonest colours, such as white, which a film has exactly
_TICKS = {".gif": 0.01, ".webp": 0.001}  # resolution of the time for which a picture is shown [s]
_BT709 = (*("-colorspace", "bt709"), *("-color_primaries", "bt709"), *("-color_trc", "bt709"))
# Index in front, so that browsers start to play before they have read the whole file.
_H264 = ("-crf", "18", "-movflags", "+faststart", "-vf", "scale=out_color_matrix=bt709", *_BT709)


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmTimes:
    """Simulated times of the n pictures of a film, at equal intervals."""

    times: Floats = field(repr=False)  #: (n,) simulated times [s]; a picture shows the recorded frame nearest in time
    every: float  #: Simulated time between two pictures [s]
    rate: float  #: Pictures per second of playing time [1/s]

    @property
    def pace(self) -> str:
        """Simulated time over playing time, as text: `0.5 × real time`."""
        return f"{float(f'{self.every * self.rate:.3g}'):g} × real time"

    @classmethod
    def choose(
        cls,
        recorded: ArrayLike,
        *,
        start: float | None = None,
        end: float | None = None,
        every: float | None = None,
        rate: float = RATE,
    ) -> Self:
        """Choose the times of a film's pictures from the ascending times (m,) [s] of the recorded frames.

        Args:
            start: Simulated time of the first picture [s]; None: that of the first frame.
            end: Latest simulated time of a picture [s]; None: that of the last frame.
            every: Simulated time between two pictures [s]; None: the least multiple of the median time between frames
                for which the film has at most `MOST` pictures.
            rate: Pictures per second of playing time [1/s].

        Raises:
            InputError: There are fewer than two frames or pictures, or an argument is out of its range.
        """
        recorded = np.asarray(recorded, dtype=np.float64)
        if len(recorded) < 2:
            raise InputError(f"a film needs at least 2 frames: got {len(recorded)}; draw a picture, .png")
        if not (math.isfinite(rate) and 0 < rate <= 100):
            raise InputError(f"fps must be above 0 and up to 100 pictures per second: got {rate:g}; {RATE:g} is usual")
        first, last = float(recorded[0]), float(recorded[-1])
        low, high = first if start is None else start, last if end is None else end
        slack = 1e-9 * max(abs(first), abs(last), 1.0)
        if not first - slack <= low < high <= last + slack:
            raise InputError(
                f"a film must begin before it ends, within {first:g} s to {last:g} s, the run's frames: "
                f"got {low:g} s to {high:g} s"
            )
        spacing = float(np.median(np.diff(recorded)))
        if every is None:
            every = spacing * max(1, math.ceil((high - low) / spacing / (MOST - 1) - 1e-6))
        elif not (math.isfinite(every) and every >= spacing * (1 - 1e-6)):
            raise InputError(f"every must be {spacing:g} s or more, the time between the run's frames: got {every:g} s")
        steps = math.floor((high - low) / every + 1e-6)
        if steps < 1:
            raise InputError(f"every {every:g} s leaves one picture between {low:g} s and {high:g} s; choose less")
        return cls(times=low + every * np.arange(steps + 1.0), every=every, rate=rate)

    def indices(self, recorded: Floats) -> list[int]:
        """Return the index of the frame nearest to each picture, by the times (m,) of the frames [s]."""
        nearest: list[int] = np.abs(recorded[None] - self.times[:, None]).argmin(axis=1).tolist()
        return nearest


def durations(count: int, rate: float, unit: float) -> list[int]:
    """Return the time for which each of `count` pictures is shown, in whole multiples of a unit [s].

    The total time of the first k pictures deviates from k / rate by at most half a unit.

    Example:
        >>> durations(4, 15.0, 0.01)
        [7, 6, 7, 7]
    """
    return [after - before for before, after in pairwise(round(k / rate / unit) for k in range(count + 1))]


def check_film(path: Path, size: tuple[int, int]) -> None:
    """Check that a film of this size [pixel] can be written to a path.

    InputError if the encoder of `.mp4` is missing, or the size is odd for `.mp4`.
    """
    if path.suffix != ".mp4":
        return
    if any(side % 2 for side in size):
        raise InputError(f"size must be even for .mp4: got {size[0]} x {size[1]} pixels")
    try:
        importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        msg = f"{path}: .mp4 needs an encoder ({error}): pip install imageio-ffmpeg, or choose .gif or .webp"
        raise InputError(msg) from None


def write_film(path: Path, images: Iterable[Image.Image], *, count: int, rate: float) -> None:
    """Write a film of `count` pictures of equal size, at a rate [pictures/s]."""
    frames = iter(images)
    first = next(frames)
    if path.suffix == ".mp4":
        encoder: Any = importlib.import_module("imageio_ffmpeg")
        writer = encoder.write_frames(
            str(path), first.size, pix_fmt_in="rgb24", pix_fmt_out="yuv420p", fps=rate, codec="libx264", quality=None,
            macro_block_size=2, output_params=[*_H264],
        )  # fmt: skip
        writer.send(None)
        try:
            for image in (first, *frames):
                writer.send(np.ascontiguousarray(image.convert("RGB")))
        finally:
            writer.close()
        return
    tick = _TICKS[path.suffix]
    shown = [round(1000 * tick) * ticks for ticks in durations(count, rate, tick)]
    options: dict[str, Any] = {"lossless": True, "method": 2} if path.suffix == ".webp" else {"optimize": False}
    whole = chain([first], frames)
    first, *rest = _of_one_palette(whole) if path.suffix == ".gif" else whole
    first.save(path, save_all=True, append_images=rest, duration=shown, loop=0, **options)


def _of_one_palette(images: Iterable[Image.Image]) -> Iterator[Image.Image]:
    """Yield pictures of a film in the same 256 colours, so that equal parts, such as the colour bar, stay equal.

    Pillow would choose the colours of each picture anew.
    """
    kept: list[bytes] = []  # as PNG, since a long film would fill the memory
    for image in images:
        content = io.BytesIO()
        image.convert("RGB").save(content, "PNG", compress_level=1)
        kept.append(content.getvalue())
    chosen = sorted({round(k) for k in np.linspace(0, len(kept) - 1, _SAMPLED)})
    palette = _palette([_opened(kept[k]) for k in chosen])
    # Pillow would round colours before it looks for the nearest one, which makes white grey.
    tree = cKDTree(palette)
    for stored in kept:
        pixels = np.asarray(_opened(stored))
        colours, places = np.unique(pixels.reshape(-1, 3) @ _DIGITS, return_inverse=True)
        nearest = tree.query(colours[:, None] // _DIGITS % 256)[1].astype(np.uint8)
        image = Image.fromarray(nearest[places].reshape(pixels.shape[:2]))
        image.putpalette(palette.ravel().tolist())
        yield image


def _palette(images: Sequence[Image.Image]) -> NDArray[np.uint8]:
    """Return the commonest colours of some images, and mixtures of all others: 256 or fewer, (n, 3)."""
    found: Counter[tuple[int, int, int]] = Counter()
    for image in images:
        pairs: Any = image.getcolors(image.width * image.height)
        found.update({colour: number for number, colour in pairs})
    ordered = np.array([colour for colour, _ in found.most_common()], np.uint8)
    exact, others = ordered[:_EXACT], ordered[_EXACT:]
    if not len(others):
        return exact
    # Each colour counts once, else the many of the background would leave few for the bodies.
    mixed = Image.fromarray(others[:, None]).quantize(256 - _EXACT, kmeans=1).getpalette() or []
    return np.concatenate([exact, np.array(mixed, np.uint8).reshape(-1, 3)[: 256 - _EXACT]])


def _opened(content: bytes) -> Image.Image:
    return Image.open(io.BytesIO(content))
