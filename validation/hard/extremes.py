"""Shapes, numbers, friction and time steps at the edge of what a scene may ask for."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from dem.errors import InputError
from dem.plan.steps import stable_step, time_step
from validation.bench import scene_of
from validation.check import Check, below, near, says
from validation.engines import EngineAccess
from validation.hard.runs import Watched, whole
from validation.hard.scenes import RELAX, REST, scene, shape_change, swing


def weight_on_floor(run: Watched, error: float) -> list[Check]:
    """The container carries the weight at the end."""
    if run.error is not None:
        return []
    force = float(run.series["container_force_N"][-5:, 2].mean())
    return [near("mean force on the container over the weight [1]", -force / run.weight, 1.0, error)]


def barbs(access: EngineAccess, out: Path, *, ratio: float, count: int) -> list[Check]:
    """The shortest barbs, none, and the longest."""
    run = whole(scene(access, RELAX, count=count, smarticle={"aspect_ratio": ratio}), out)
    # Rods roll.
    return run.sound(rest=0.05) + weight_on_floor(run, 0.02)


def rods(access: EngineAccess, out: Path, *, count: int, radius: float) -> list[Check]:
    """Bars without barbs, little inertia about themselves, in a narrow container."""
    data = scene(access, RELAX, count=count, smarticle={"aspect_ratio": 0}, container={"radius_m": radius})
    data["phases"][0]["settle"] = {"timeout_s": 1}
    run = whole(data, out)
    return [*run.sound(rest=0.1), *weight_on_floor(run, 0.05)]


def one(access: EngineAccess, out: Path) -> list[Check]:
    """N = 1, poured, actuated, welded."""
    run = whole(scene(access, swing(0.1), RELAX, count=1), out)
    checks = run.sound() + weight_on_floor(run, 0.02)
    if run.error is None:
        known = int(np.isfinite(run.series["packing_fraction"]).sum())
        error = float(run.series["tracking_error_rad"][run.during(1)].max())
        checks += [
            below("samples with a packing fraction, which needs two smarticles [1]", known, 0.5),
            below("largest tracking error [rad]", error, 0.05),
        ]
    return checks


def checkpoint_last(access: EngineAccess, out: Path) -> list[Check]:
    """A run whose last step is that of a checkpoint: what was just loaded has no contacts to look at yet."""
    recording = {"series_interval_s": 0.01, "frame_interval_s": 0.04, "checkpoint_interval_s": 0.01}
    run = whole(scene(access, RELAX, count=2, recording=recording), out)
    return [*run.sound(), *weight_on_floor(run, 0.02)]


def many(access: EngineAccess, out: Path, *, count: int, per_layer: int, radius: float) -> list[Check]:
    """Very many in a wide container."""
    run = whole(scene(access, RELAX, count=count, per_layer=per_layer, container={"radius_m": radius}), out)
    return run.sound(rest=0.1) + weight_on_floor(run, 0.02)


def friction(access: EngineAccess, out: Path, *, value: float, count: int) -> list[Check]:
    """No friction, and plenty."""
    data = scene(access, RELAX, count=count, contact={"friction_smarticle": value, "friction_wall": value})
    data["phases"][0]["settle"] = {"timeout_s": 2}
    run = whole(data, out)
    # Without friction what slides goes on sliding, at the speed of a fall from 0.1 mm.
    return run.sound(rest=0.05 if not value else 0.02) + weight_on_floor(run, 0.05)


def _with_step(data: dict[str, Any], share: float) -> tuple[dict[str, Any], float, float]:
    """The scene with its time step set to a share of the stable one [s], the step [s], and the stable one [s]."""
    stable = stable_step(scene_of(data))
    return {**data, "fidelity": {"base": "draft", "time_step_s": share * stable}}, share * stable, stable


def step_below(access: EngineAccess, out: Path, *, share: float, count: int) -> list[Check]:
    """A time step by hand, below the stable one."""
    data, asked, _ = _with_step(scene(access, swing(0.04), REST, count=count), share)
    run = whole(data, out)
    assert run.scene is not None  # draft, and a step that is allowed
    # Shorter, but for rounding, by as much as makes it a whole fraction of the control period.
    fraction = run.scene.fidelity.control_interval_s / asked
    expected = fraction / math.ceil(fraction - 1e-9)
    return [*run.sound(), near("step taken over the step asked [1]", time_step(run.scene) / asked, expected, 1e-6)]


def step_above(access: EngineAccess, out: Path, *, share: float) -> list[Check]:
    """A time step by hand, above the stable one."""
    data, asked, stable = _with_step(scene(access, shape_change(1.5)), share)
    run = whole(data, out)
    made = Check("run directory", "made" if out.exists() else "none", "none", not out.exists())
    return [
        says(run.text, f"fidelity.time_step_s: {asked:g} s is above the stable step {stable:.4g} s", "use at most"),
        made,
    ]


def narrowest(data: dict[str, Any], margin: float) -> tuple[dict[str, Any], Check]:
    """The scene in a container by `margin` [1] wider than the least, and the check that a narrower one is refused."""
    reach = scene_of(data).particle.reach
    said = None
    try:
        scene_of({**data, "container": {"radius_m": 0.999 * reach}})
    except InputError as error:
        said = str(error)
    return {**data, "container": {"radius_m": reach * (1 + margin)}}, says(said, f"use at least {reach:.4g} m")
