"""Films from pictures: `.gif` and `.webp` by Pillow, `.mp4` where imageio and ffmpeg are installed."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from dem.errors import InputError

KINDS = (".gif", ".webp", ".mp4")
"""Suffixes of films."""


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
        importlib.import_module("imageio.v2")
        importlib.import_module("imageio_ffmpeg")
    except ImportError as error:
        msg = f"{path}: .mp4 needs the package {error.name}: pip install 'imageio[ffmpeg]', or choose .gif"
        raise InputError(msg) from None


def write_film(path: Path, images: Iterable[Image.Image], rate: float, samples: Sequence[Image.Image]) -> None:
    """Writes a film, one picture at a time.

    Args:
        path: With a suffix of `KINDS`.
        images: All of one size.
        rate: Pictures per second [1/s].
        samples: Some of the pictures. A `.gif` has 256 colours; they are chosen from these, once for
            the whole film, or colours would flicker.
    """
    if path.suffix == ".mp4":
        imageio: Any = importlib.import_module("imageio.v2")
        with imageio.get_writer(path, fps=rate, codec="libx264", quality=8, macro_block_size=2) as writer:
            for image in images:
                writer.append_data(np.asarray(image))
        return
    frames = iter(images)
    if path.suffix == ".gif":
        palette = _palette(samples)
        frames = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in frames)
    first = next(frames)
    first.save(path, save_all=True, append_images=frames, duration=round(1000 / rate), loop=0)


def _palette(samples: Sequence[Image.Image]) -> Image.Image:
    """An image with the 256 colours that suit all samples."""
    return Image.fromarray(np.concatenate([np.asarray(image) for image in samples])).quantize(256)
