"""What is written above a picture: run, time, and the two numbers that `smarticles measure` gives of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.measures.entanglement import entanglement
from postprocess.measures.packing import packing_of
from postprocess.pictures.canvas import Caption

DEFINITION = "second-highest-com"
"""Definition of the packing fraction in captions, as in the first column of `smarticles measure`."""


def titles_of(runs: Sequence[Run]) -> list[str]:
    """Return the headings of runs beside each other: their names, with their folders where these are alike."""
    names = [run.manifest.name for run in runs]
    if len(set(names)) == len(names):
        return names
    folders = [run.path.resolve() for run in runs]
    # As much of the path as tells them apart: runs of sweeps differ in their last part, others may not.
    depth = 1
    longest = max(len(folder.parts) for folder in folders)
    while len({folder.parts[-depth:] for folder in folders}) < len(set(folders)) and depth < longest:
        depth += 1
    return [f"{name} ({'/'.join(folder.parts[-depth:])})" for name, folder in zip(names, folders, strict=True)]


def caption_of(frame: Frame, run: Run, *, title: str, pace: str = "", force: float | None = None) -> Caption:
    """Return the caption of a frame.

    Args:
        title: The heading.
        pace: How fast a film plays; empty for a picture.
        force: Normal force of the thickest line of force [N]; None where none are drawn.
    """
    count = f"{run.manifest.count}" if frame.count == run.manifest.count else f"{frame.count} of {run.manifest.count}"
    phase = run.phases[frame.phase].type if frame.phase < len(run.phases) else "?"
    when = f"t = {frame.time:.3f} s ({phase})"
    lines = [f"l/w = {run.manifest.aspect_ratio:g}   N = {count}   {when}"]
    if pace:
        lines[0] += f"   {pace}"
    if not run.manifest.planar:  # neither packing nor crossings have a meaning there
        mean = entanglement(frame.vertices).mean
        passed = f"⟨N⟩ = {mean:.2f}" if math.isfinite(mean) else "no ⟨N⟩: all are straight"
        lines.append(f"{packing_text(frame, run)}   {passed}")
    if force is not None:
        lines[-1] += f"   widest line: {1e3 * force:.3g} mN"
    return Caption(title, tuple(lines))


def packing_text(frame: Frame, run: Run) -> str:
    """Return φ as `smarticles measure --frames` gives it for this frame, or why it does not."""
    value = packing_of(frame, run, definition=DEFINITION)
    if math.isfinite(value):
        return f"φ = {value:.4f} ({DEFINITION})"
    if run.manifest.container_tiers > 1:
        return f"no φ: a mould of {run.manifest.container_tiers} tiers"
    if not run.manifest.walled(frame.phase):
        return "no φ: the wall is gone"
    if frame.count < 2:
        return "no φ: fewer than 2 smarticles"
    return "no φ: the pile has no height"
