"""Time steps: from what is stable, into intervals; walls, hooks and strings move by a small part of a sphere in one."""

import math
import re
from typing import Any

import pytest
from scenes import chain, small

from dem.errors import InputError
from dem.plan.outlook import plan
from dem.plan.steps import MOST_PER_STEP, limiting_spans, stable_step, time_step, time_steps
from dem.scene.scene import Scene

DEPOSIT = {"type": "deposit"}
COARSE = {"fidelity": {"base": "draft", "stiffness_N_per_m": 20}}  # a stable step of 0.2 ms and more
WORM = {"shape": "filament", "length_m": 0.03, "diameter_m": 0.8e-3, "segments": 6, "young_modulus_Pa": 2e4}
MOTOR = {
    **{"law": "motor", "torque_limit_N_m": 2e-4, "stiffness_N_m_per_rad": 1e-3, "damping_N_m_s_per_rad": 2e-7},
    **{"speed_limit_rad_per_s": 30},
}
LINKS = {"shape": "chain", "link_m": [0.006, 0.005], "diameter_m": 1.5e-3, "joints": [MOTOR]}
WORMS: dict[str, Any] = {
    **{"engine": "links", "particle": WORM, "liquid": {}, "count": 2},
    **{"fidelity": {"base": "draft", "stiffness_N_per_m": 10}},
}
CHAINS: dict[str, Any] = {"engine": "links", "particle": LINKS, "count": 2}
VIBRATED = {"type": "compress", "speed_m_per_s": 0.01}
HELD = {"type": "lift", "duration_s": 0.1, "speed_m_per_s": 0.1}


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


# -- drives ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("phase", "more", "seconds"),
    [
        ({"type": "shake", "frequency_hz": 1900}, {**COARSE, "engine": "yade"}, 1 / 1900),
        ({"type": "shake", "frequency_hz": 1900}, {**COARSE, "engine": "lammps"}, 1 / 1900),
        ({"type": "shake", "frequency_hz": 1900}, {"engine": "links"}, 1 / 1900),
        (
            {**VIBRATED, "vibration": {"peak_acceleration_g": 1, "frequency_hz": 1900}},
            {"engine": "links"},
            1 / 1900,
        ),
        (
            {**VIBRATED, "vibration": {"peak_acceleration_g": 1, "windows_s": [[0, 0.1], [0.1003, 0.2]]}},
            {"engine": "links"},
            0.0003,
        ),
        ({"type": "wriggle", "duration_s": 0.1, "curvature_per_m": 100, "frequency_hz": 9000}, WORMS, 1 / 9000),
        ({"type": "wriggle", "duration_s": 0.1, "curvature_per_m": 100, "ramp_s": 5e-4}, WORMS, 5e-4),
        ({"type": "undulate", "duration_s": 0.1, "amplitude_deg": 0.02, "frequency_hz": 9000}, CHAINS, 1 / 9000),
        (
            {
                **{"type": "undulate", "duration_s": 0.1, "frequency_hz": 9000},
                **{"joints": [{"joint": 0, "amplitude_deg": 0.02}]},
            },
            CHAINS,
            1 / 9000,
        ),
        ({**HELD, "distance_m": 2e-5}, {"engine": "links"}, 2e-4),
        (
            {"type": "pull-hook", "duration_s": 0.1, "speed_m_per_s": 0.1, "distance_m": 2e-5},
            {"engine": "links", "hooks": {}},
            2e-4,
        ),
        (
            {"type": "tension", "grip_m": 1e-3, **HELD, "distance_m": 2e-5} | {"type": "tension"},
            {"engine": "links"},
            2e-4,
        ),
    ],
)
def test_every_drive_has_twenty_steps_in_its_shortest_time_or_is_rejected(
    phase: dict[str, Any], more: dict[str, Any], seconds: float
) -> None:
    scene = small({"phases": [DEPOSIT, phase], **more})
    before, driven = time_steps(scene)
    assert before == time_step(scene) > seconds / 20  # stability alone does not resolve it
    assert 0.9 * seconds / 20 < driven <= seconds / 20 * (1 + 1e-9)
    whole = scene.recording.series_interval_s / driven
    assert whole == pytest.approx(round(whole), abs=1e-9)
    (limit,) = [span for span in limiting_spans(scene) if span is not None]
    assert limit.seconds == pytest.approx(seconds)
    planned = plan(scene)
    assert f"phase 1: {driven:.3g} s, as {limit.key} ({limit.value}) needs" in planned.to_text()
    assert planned.time_step_s == driven
    # With a step of one's own there is no other.
    fidelity = {**dict(more.get("fidelity", {"base": "draft"})), "time_step_s": before}
    changes = {"phases": [DEPOSIT, phase], **more, "fidelity": fidelity}
    error = rejection(small(changes))
    assert f"fidelity.time_step_s: {before:g} s makes {seconds / before:.3g} time steps in the" in error
    assert limit.key.startswith("phases.1.")
    assert limit.key in error
    assert limit.value in error
    offered = re.search(r"use at most (\S+) s or leave it out", error)
    assert offered is not None
    changes["fidelity"] = {**fidelity, "time_step_s": float(offered[1])}
    assert time_steps(small(changes))[1] <= seconds / 20 * (1 + 1e-9)


@pytest.mark.parametrize(
    ("phase", "more"),
    [
        ({"type": "shake", "frequency_hz": 30}, {"engine": "links"}),
        ({"type": "shake", "frequency_hz": 1900, "peak_acceleration_g": 0}, {"engine": "links"}),
        ({"type": "wriggle", "duration_s": 0.1, "curvature_per_m": 0, "frequency_hz": 9000}, WORMS),
        ({"type": "undulate", "duration_s": 0.1, "frequency_hz": 9000, "ramp_s": 0}, CHAINS),
        ({**HELD, "distance_m": 0}, {"engine": "links"}),
    ],
)
def test_what_is_slow_or_does_not_move_leaves_the_step(phase: dict[str, Any], more: dict[str, Any]) -> None:
    scene = small({"phases": [DEPOSIT, phase], **more})
    assert time_steps(scene) == (time_step(scene),) * 2
    assert limiting_spans(scene) == (None, None)


def test_bending_that_goes_on_keeps_its_step_until_another_phase_ends_it() -> None:
    fast = {"type": "wriggle", "duration_s": 0.1, "curvature_per_m": 100, "frequency_hz": 9000}
    lift = {"type": "lift", "distance_m": 0.003, "speed_m_per_s": 0.03}
    for end in ({"type": "relax"}, {**fast, "frequency_hz": 1}):
        steps = time_steps(small({"phases": [DEPOSIT, fast, lift, {"type": "release"}, end], **WORMS}))
        assert steps[0] == steps[4] > steps[1] == steps[2] == steps[3]


@pytest.mark.parametrize("engine", ["yade", "lammps", "links"])
@pytest.mark.parametrize("frequency", [31.0, 700.0])
def test_cycles_of_taps_are_whole_and_those_that_vary_are_nearly_so(engine: str, frequency: float) -> None:
    def tapped(**more: Any) -> float:
        phase = {"type": "shake", "taps": 2, "frequency_hz": frequency, "peak_acceleration_g": 2, **more}
        return time_steps(
            small({"phases": [DEPOSIT, phase], "engine": engine, **({} if engine == "links" else COARSE)})
        )[1]

    for step in (tapped(), tapped(peak_acceleration_end_g=1)):
        steps = 1 / frequency / step
        assert steps >= 20 * (1 - 1e-9)
        assert steps == pytest.approx(round(steps), abs=1e-6)
    # Taps of other lengths are each rounded by half a step at most, 0.25 %.
    assert tapped(frequency_end_hz=1.2 * frequency) <= 2.5e-3 / (1.2 * frequency) / 0.5 * (1 + 1e-9)
