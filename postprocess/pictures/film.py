"""Films from pictures: `.gif` and `.webp` by Pillow, `.mp4` by the ffmpeg of the package imageio-ffmpeg."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from dem.errors import InputError
from postprocess.pictures.moments import durations

if TYPE_CHECKING:
    from numpy.typing import NDArray

KINDS = (".gif", ".webp", ".mp4")
"""Suffixes of films."""

# What a format can tell of the time that a picture is shown [s].
_TICKS = {".gif": 0.01, ".webp": 0.001}
_COLOURS = 256  # of a GIF
_BT709 = (*("-colorspace", "bt709"), *("-color_primaries", "bt709"), *("-color_trc", "bt709"))
_H264 = ("-crf", "18", "-movflags", "+faststart", "-vf", "scale=out_color_matrix=bt709", *_BT709)


def check_film(path: Path, size: tuple[int, int]) -> None:
    """Complains before anything is drawn.

    Args:
        path: The film to be.
        size: Width and height [pixel].

    Raises:
        InputError: Such a film cannot be written here: a package is missing, or the size does not
            suit.
    """
    if path.suffix != ".mp4":
        return
    if any(side % 2 for side in size):
        msg = f"size must be even for .mp4: got {size[0]} x {size[1]} pixels"
        raise InputError(msg)
    try:
        importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        msg = f"{path}: .mp4 needs an encoder ({error}): pip install imageio-ffmpeg, or choose .gif or .webp"
        raise InputError(msg) from None


def write_film(
    path: Path,
    images: Iterable[Image.Image],
    *,
    count: int,
    rate: float,
    samples: Sequence[Image.Image],
    keys: NDArray[np.uint8],
) -> None:
    """Writes a film, one picture at a time.

    An `.mp4` is H.264 with 4:2:0 colours and its index in front, which browsers, phones and slides play.

    Args:
        path: With a suffix of `KINDS`.
        images: All of one size.
        count: How many.
        rate: Pictures per second [1/s].
        samples: Some of the pictures. A `.gif` has 256 colours; they are chosen once for the whole film, or colours
            would flicker.
        keys: (n, 3) colours that a `.gif` shall have exactly, 0 to 255: those of the colour bar.
    """
    if path.suffix == ".mp4":
        _write_mp4(path, images, rate)
        return
    frames = iter(images)
    if path.suffix == ".gif":
        frames = map(Palette.of(samples, keys).indexed, frames)
    tick = _TICKS[path.suffix]
    shown = [round(1000 * tick) * ticks for ticks in durations(count, rate, tick)]
    first = next(frames)
    options: dict[str, Any] = {"lossless": True, "method": 2} if path.suffix == ".webp" else {"optimize": False}
    first.save(path, save_all=True, append_images=frames, duration=shown, loop=0, **options)


class Palette:
    """The 256 colours of a film.

    Args:
        colours: (256, 3), 0 to 255.
    """

    def __init__(self, colours: NDArray[np.uint8]) -> None:
        self._bytes = colours.ravel().tolist()
        # Pillow looks for the nearest colour once per cube of 4 x 4 x 4 colours, and so misses exact ones.
        self._tree = cKDTree(colours.astype(np.float64))

    @classmethod
    def of(cls, samples: Sequence[Image.Image], keys: NDArray[np.uint8]) -> Self:
        """The keys, and what suits all samples best besides.

        Median cut alone gives colours by the area they cover: two steps of a colour bar that few smarticles have would
        share one.

        Args:
            samples: Pictures.
            keys: (n, 3) colours, 0 to 255; up to 128 of them are kept.
        """
        kept = np.unique(np.asarray(keys, dtype=np.uint8).reshape(-1, 3), axis=0)[:128]
        pixels = np.concatenate([np.asarray(image.convert("RGB")).reshape(-1, 3) for image in samples])
        # White is most of a picture: every colour counts once for each of its shades.
        shades = np.unique(pixels // 4 * 4 + 2, axis=0)
        found = Image.fromarray(shades[None]).quantize(_COLOURS - len(kept) - 2, kmeans=2)
        extra = np.array(found.getpalette(), dtype=np.uint8).reshape(-1, 3)
        colours = np.zeros((_COLOURS, 3), dtype=np.uint8)
        listed = np.concatenate([[[255, 255, 255], [0, 0, 0]], kept, extra])[:_COLOURS]
        colours[: len(listed)] = listed
        return cls(colours)

    def indexed(self, image: Image.Image) -> Image.Image:
        """A picture in these colours, the nearest of each pixel."""
        pixels = np.asarray(image.convert("RGB")).astype(np.int64)
        packed = (pixels[..., 0] << 16) | (pixels[..., 1] << 8) | pixels[..., 2]
        different, which = np.unique(packed, return_inverse=True)
        channels = np.stack([different >> 16, different >> 8 & 255, different & 255], axis=1)
        _, nearest = self._tree.query(channels.astype(np.float64))
        result = Image.fromarray(nearest.astype(np.uint8)[which.reshape(packed.shape)])
        result.putpalette(self._bytes)
        return result


def _write_mp4(path: Path, images: Iterable[Image.Image], rate: float) -> None:
    encoder: Any = importlib.import_module("imageio_ffmpeg")
    writer: Any = None
    try:
        for image in images:
            if writer is None:
                writer = encoder.write_frames(
                    str(path),
                    image.size,
                    pix_fmt_in="rgb24",
                    pix_fmt_out="yuv420p",
                    fps=rate,
                    codec="libx264",
                    quality=None,
                    macro_block_size=2,
                    output_params=[*_H264],
                )
                writer.send(None)
            writer.send(np.ascontiguousarray(image.convert("RGB")))
    finally:
        if writer is not None:
            writer.close()
