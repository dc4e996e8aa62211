"""Time steps: from what is stable, into intervals; walls, hooks and strings move by a small part of a sphere in one."""

import math
import re
from typing import Any

import pytest
from scenes import chain, small

from dem.errors import InputError
from dem.plan.steps import MOST_PER_STEP, stable_step, time_step, time_steps
from dem.scene.scene import Scene

DEPOSIT = {"type": "deposit"}


def rejection(scene: Scene) -> str:
    with pytest.raises(InputError) as caught:
        time_steps(scene)
    return str(caught.value)


def fastest(scene: Scene) -> float:
    return MOST_PER_STEP * scene.sphere_diameter / time_step(scene)


@pytest.mark.parametrize("kind", ["remove-container", "pull-hook"])
def test_what_is_lifted_or_pulled_too_fast_is_rejected(kind: str) -> None:
    def moved_at(speed: float, fidelity: Any = "draft") -> Scene:
        phases = [DEPOSIT, {"type": kind, "speed_m_per_s": speed, "duration_s": 3.0}]
        return small({"hooks": {}, "phases": phases, "fidelity": fidelity})

    most = fastest(moved_at(0.01))
    assert 0.3 < most < 1
    time_steps(moved_at(0.999 * most))
    error = rejection(moved_at(10.0))
    assert re.fullmatch(
        rf"phases\.1\.speed_m_per_s: 10 m/s \({kind}\) is 0\.\d+ sphere diameters in a time step of \S+ s, which "
        r"contacts cannot follow; use at most (\S+) m/s or a shorter fidelity\.time_step_s",
        error,
    )
    offered = re.search(r"at most (\S+) m/s", error)
    assert offered is not None
    time_steps(moved_at(float(offered[1])))
    assert float(offered[1]) == pytest.approx(most, rel=0.01)
    # The other way out.
    step = 0.9 * time_step(moved_at(0.01)) * most / 10
    time_steps(moved_at(10.0, {"base": "draft", "time_step_s": step}))


@pytest.mark.parametrize("engine", ["yade", "links"])
def test_shaking_that_starts_too_fast_is_rejected(engine: str) -> None:
    def shaken_at(peak: float) -> Scene:
        shake = {"type": "shake", "peak_acceleration_g": peak, "frequency_hz": 1.0}
        phases = [DEPOSIT, {"type": "remove-container"}, shake]  # no wall that smarticles are thrown over
        return small({"engine": engine, "phases": phases, "fidelity": {"time_step_s": 1e-5}})

    # Γg/(2πf) per step is 0.05 diameters.
    most = 0.05 * shaken_at(0.1).sphere_diameter / 1e-5 * 2 * math.pi / 9.81
    time_steps(shaken_at(0.999 * most))
    error = rejection(shaken_at(1.5 * most))
    assert error.startswith(f"phases.2.peak_acceleration_g: {1.5 * most:g} g (shake) is 0.075 sphere diameters in a")
    offered = re.search(r"use at most (\S+) g or a shorter fidelity\.time_step_s", error)
    assert offered is not None
    time_steps(shaken_at(float(offered[1])))


@pytest.mark.parametrize(("fidelity", "series"), [("draft", 0.004), ("standard", 0.0033), ("reference", 1e-5)])
def test_time_step_divides_the_recording_intervals(fidelity: str, series: float) -> None:
    changes = {"fidelity": fidelity, "recording": {"series_interval_s": series}}
    changes["recording"] |= {"frame_interval_s": 10 * series, "checkpoint_interval_s": None}
    scene = small(changes)
    dt = time_step(scene)
    steps = series / dt
    assert steps == pytest.approx(round(steps), abs=1e-9)
    wanted = scene.fidelity.time_step_fraction * stable_step(scene)
    assert dt <= min(wanted, series) * (1 + 1e-9)
    if series > 10 * wanted:
        assert dt > 0.9 * wanted  # no smaller than needed


@pytest.mark.parametrize(("key", "value"), [("hinge_stiffness_N_per_m", 1e6), ("stiffness", 10.0)])
def test_stiff_hinges_and_shafts_shorten_the_step(key: str, value: float) -> None:
    phases = [{"type": "deposit"}, {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1}]
    usual = small({"phases": phases})
    changed = {"fidelity": {key: value}} if key.startswith("hinge") else {"motor": {"stiffness_N_m_per_rad": value}}
    stiff = small({"phases": phases, **changed})
    # A shaft of 3e-3 N m/rad is far from ruling the step, one of 10 rules it.
    assert time_step(stiff) < 0.5 * time_step(usual)
    barb = stiff.smarticle.boxes
    if key == "stiffness":
        # A barb on its shaft against a middle link that is heavier: between a free and a fixed end.
        about_hinge = barb.link_inertias[0, 2] + barb.link_masses[0] * (barb.barb_length / 2) ** 2
        fixed = 2 / math.sqrt(value / about_hinge)
        assert 0.2 * fixed < time_step(stiff) < fixed


SWING: dict[str, object] = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1}


def test_phases_before_the_motors_have_the_step_of_a_scene_without() -> None:
    rest: list[dict[str, object]] = [{"type": "deposit"}, {"type": "relax", "duration_s": 1}]
    scene, without = small({"phases": [*rest, SWING, *rest[1:]]}), small({"phases": rest})
    shortest = time_step(scene)
    assert time_steps(scene) == (*time_steps(without), shortest, shortest)
    assert time_steps(without) == (time_step(without),) * 2
    assert time_steps(scene)[0] > 1.5 * shortest


def test_a_servo_needs_a_control_update_in_every_step() -> None:
    assert time_step(chain()) == pytest.approx(1e-4)
    with pytest.raises(InputError, match=r"fidelity.control_interval_s: 0.0005 s is 5 time steps, but a servo"):
        time_step(chain({"fidelity.control_interval_s": 5e-4}))


@pytest.mark.parametrize(("engine", "shorter"), [("links", 2.0), ("yade", 1.0)])
def test_steps_on_links_are_half_as_long_where_impacts_lose_nothing(engine: str, shorter: float) -> None:
    def relative_step(restitution: float) -> float:
        # A long interval, so that a whole number of steps fits into it.
        recording = {"series_interval_s": 0.1, "frame_interval_s": 0.1, "checkpoint_interval_s": None}
        scene = small({"engine": engine, "contact.restitution": restitution, "recording": recording})
        return time_step(scene) / stable_step(scene)

    assert relative_step(0.95) / relative_step(0.96) == pytest.approx(shorter, rel=0.01)
    given = {"engine": engine, "contact.restitution": 1, "fidelity": {"base": "draft", "time_step_s": 2e-5}}
    assert time_step(small(given)) == pytest.approx(2e-5)
