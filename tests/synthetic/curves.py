"""Knots, links and random rods as segments."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rings(*corners: Floats, closed: bool = True) -> tuple[Floats, NDArray[np.int64]]:
    """Segments and bodies of curves, each by its corners (n, 3)."""
    parts = [np.stack([one, np.roll(one, -1, axis=0)], axis=1)[: None if closed else -1] for one in corners]
    return np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])


def torus_curve(around: int, through: int, *, corners: int = 24, shift: float = 0.0) -> Floats:
    """A curve on a torus of radii 2 and 1, `around` its axis and `through` its hole."""
    t = 2 * np.pi * np.arange(corners) / corners
    angle = through * t + shift
    return np.stack(
        [(2 + np.cos(angle)) * np.cos(around * t), (2 + np.cos(angle)) * np.sin(around * t), np.sin(angle)], axis=1
    )


def whitehead() -> tuple[Floats, Floats]:
    """The alternating link of a circle and an eight that crosses itself once and the circle four times."""
    t = 2 * np.pi * np.arange(24) / 24
    circle = np.stack([1.2 * np.cos(t), 1.2 * np.sin(t), 0 * t], axis=1)
    s = 2 * np.pi * (np.arange(48) + 0.5) / 48
    # Over and under in turn: own crossing, out and in of the right lobe, own crossing, out and in of the left lobe.
    meets = 0.3546  # where the eight meets the circle, seen from above
    turns = [0, meets, np.pi - meets, np.pi, np.pi + meets, 2 * np.pi - meets, 2 * np.pi]
    height = np.interp(s, turns, [1, -1, 1, -1, 1, -1, 1])
    return circle, np.stack([2 * np.sin(s), 1.5 * np.sin(2 * s), height], axis=1)


def random_rods(count: int, length: float, random: np.random.Generator) -> Floats:
    """Rods of random direction (N, 2, 3), with middles normally distributed with deviation 1."""
    direction = random.normal(size=(count, 3))
    direction *= length / 2 / np.linalg.norm(direction, axis=1, keepdims=True)
    middle = random.normal(size=(count, 3))
    return np.stack([middle - direction, middle + direction], axis=1)
