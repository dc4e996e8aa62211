"""Run directories whose wall was taken away, with piles laid by hand before and after."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from synthetic import T1, SyntheticRun, u_shape, write_frame, write_run

ACTIVITY = {
    "static": (),
    "external": ("shake",),
    "internal": ("internal-oscillation",),
    "shape-change": ("shape-change",),
}
FRAMES = 4


def stack(count: int = 10, aspect_ratio: float = 0.7) -> NDArray[np.float64]:
    """(N, 4, 3) [m], U-shapes flat on each other on the container's axis, each touching the next."""
    heights = T1 * (np.arange(count) + 0.5)
    upright = np.array([0.0, 0.0, 1.0])
    return u_shape(aspect_ratio * 0.0117) + heights[:, None, None] * upright


def write_released(
    directory: Path,
    procedure: str,
    *,
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    seed: int = 1,
    lift: float | None = None,
    tiers: list[dict[str, float]] | None = None,
    aspect_ratio: float = 0.7,
) -> Path:
    """A run of four frames per phase; the pile is `before` in the rest, and `after` from half of the removal on."""
    phases = ("deposit", *ACTIVITY[procedure], "relax", "remove-container")
    run = SyntheticRun(
        phases=phases, seed=seed, count=len(before), aspect_ratio=aspect_ratio, frames_per_phase=FRAMES, series=False
    )
    write_run(directory, run)
    start = sum(run.durations[kind] for kind in phases[:-1])
    for k in range(2 * FRAMES):
        removal, number = divmod(k, FRAMES)
        vertices = after if removal and number >= FRAMES // 2 - 1 else before
        # 0.5 s of rest, 2 s without the wall.
        time = start - 0.5 * (1 - (number + 1) / FRAMES) if not removal else start + 2.0 * (number + 1) / FRAMES
        file = directory / "frames" / f"frame_{FRAMES * (len(phases) - 2) + k:06d}.vtu"
        write_frame(file, vertices, time=time, phase=len(phases) - 2 + removal)
    path = directory / "scene.yaml"
    scene: dict[str, Any] = yaml.safe_load(path.read_text())
    scene["phases"][-1]["speed_m_per_s"] = lift
    scene["container"] = {"radius_m": 0.0234, "tiers": tiers}
    path.write_text(yaml.safe_dump(scene))
    return directory
