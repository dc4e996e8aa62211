"""Reject scenes that would fail: pours without damping, and walls over which bodies are thrown.

With restitution e, a body that is thrown down at speed v rebounds with e v. A body at rest that the floor hits at v
leaves with (1 + e) v. Both rise by the square of their speed over 2g. Other bodies and the height of the pile are not
considered.
"""

import math

from dem.errors import InputError
from dem.phases.compress import Compress
from dem.phases.deposit import Deposit
from dem.phases.shake import Shake
from dem.scene.scene import Scene
from dem.setting.part import LONGEST_LENGTH
from dem.setting.vibration import shaking_amplitude

# Least height of a wall over the estimated rise of bodies, if the scene gives the height. In random extreme scenes on
# links, no body left the container with estimates up to 0.9 of the wall. With estimates from 0.93 to 1.9, three of
# eight pours with thrown bodies lost some over the wall; with estimates from 1.0 on, three of three shakes did.
MARGIN = 1.1
# The same ratio for walls of the default height. Up to 50 bodies thrown at 2 m/s, as under the code's rules, rise to
# between 0.5 and 1.0 of the wall at an estimate of 1.04.
DOUBT = 0.9


def check_ends(scene: Scene) -> None:
    """Raise InputError if a pour cannot settle for lack of damping, or if the wall is too low."""
    if scene.plane is not None or scene.liquid is not None or not scene.gravity_m_per_s2:
        return
    for index, phase in enumerate(scene.phases):
        if phase.frees:
            return
        if isinstance(phase, Deposit):
            _check_pour(scene, phase)
        elif isinstance(phase, Shake):
            frequency, peak = phase.fastest
            key, amplitude = f"phases.{index}.{phase.frequency_key(frequency)}", phase.amplitude(scene.gravity_m_per_s2)
            _check_shaking(scene, key, frequency, peak, amplitude)
        elif (vibration := phase.vibrated_by) is not None and not isinstance(phase, Compress):  # it has a plate
            key, amplitude = f"phases.{index}.vibration.frequency_hz", vibration.amplitude(scene.gravity_m_per_s2)
            _check_shaking(scene, key, vibration.frequency_hz, vibration.peak_acceleration_g, amplitude)


def _check_pour(scene: Scene, pour: Deposit) -> None:
    contact, gravity, speed = scene.contact, scene.gravity_m_per_s2, pour.thrown_at_m_per_s
    if contact.restitution == 1:
        raise InputError(
            "contact.restitution: 1 means contacts without damping, so that what phases.0 (deposit) pours goes on "
            "bouncing and vibrating, and never counts as settled; use at most 0.95"
        )
    rise = (contact.restitution * speed) ** 2 / (2 * gravity)
    if (excess := _excess(scene, rise)) > 1:
        raise InputError(
            f"phases.0.thrown_at_m_per_s: what is thrown at {speed:g} m/s rebounds by {rise:.3g} m at "
            f"contact.restitution = {contact.restitution:g}, out of the wall of {scene.cylinder.height:.3g} m; use at "
            f"most {0.995 * speed / math.sqrt(excess):.3g} m/s{_or_higher(rise)}"
        )


def _check_shaking(scene: Scene, key: str, frequency: float, peak: float, amplitude: float) -> None:
    # `frequency` [Hz] and `peak`, Γ [1], where the speed is greatest; `amplitude`: the greatest one [m].
    gravity = scene.gravity_m_per_s2
    if peak <= 1:  # nothing leaves the floor
        return
    # The wall is at its lowest when the body is at its highest.
    speed = (1 + scene.contact.restitution) * shaking_amplitude(peak, frequency, gravity) * 2 * math.pi * frequency
    rise = amplitude + speed**2 / (2 * gravity)
    if (excess := _excess(scene, rise)) > 1:
        raise InputError(
            f"{key}: {frequency:g} Hz at Γ = {peak:g} throws smarticles up by "
            f"{rise:.3g} m, out of the wall of {scene.cylinder.height:.3g} m; use at least "
            f"{1.005 * frequency * math.sqrt(excess):.3g} Hz{_or_higher(rise)}"
        )


def _excess(scene: Scene, rise: float) -> float:
    """Return the height that a wall needs for a rise of bodies [m], over the height of the scene's wall [1]."""
    return (DOUBT if scene.container.height_m is None else MARGIN) * rise / scene.cylinder.height


def _or_higher(rise: float) -> str:
    """Return the advice to raise the wall for a rise of bodies [m]; empty if no wall may be so high."""
    least = 1.005 * MARGIN * rise
    return f" or container.height_m: {least:.3g}" if least < LONGEST_LENGTH else ""
