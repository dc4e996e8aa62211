"""Functions for phases that move a hook, a grip or a plate at constant speed, and check the force on it."""

from collections.abc import Iterator, Mapping
from typing import Any

from dem.engine.interface import Engine
from dem.errors import rounded_up
from dem.phases.phase import Memory, time_left
from dem.setting.hooks import TOLERANCE
from dem.setting.span import Span

HELD_SECONDS = 0.1  # s, time for which the force is measured on a hook or a grip that its limit has stopped


def travel_time(data: Mapping[str, Any]) -> float:
    """Return the default of `duration_s` [s], from values of a phase's other fields by name."""
    return float(data["distance_m"] / data["speed_m_per_s"])


def span_of_travel(distance: float, speed: float) -> Iterator[Span]:
    """Yield the time that a travel over a distance [m] at a speed [m/s] takes; nothing without travel."""
    if distance:
        yield Span(key="distance_m", value=f"{distance:g} m at {speed:g} m/s", seconds=distance / speed)


def reject_early_end(what: str, *, duration: float, distance: float, speed: float) -> None:
    """Raise ValueError if a duration [s] is too short for a distance [m] at a speed [m/s].

    `what` is what the phase does, such as "raise the hook".
    """
    needed = distance / speed
    if duration < needed * (1 - TOLERANCE):
        raise ValueError(
            f"duration_s: {duration:g} s is too short to {what} by distance_m = {distance:g} m at "
            f"speed_m_per_s = {speed:g} m/s; use at least {rounded_up(needed, 6)} s"
        )


def travel_to_text(distance: float, speed: float, limit: float | None = None) -> str:
    """Return a distance [m], a speed [m/s] and a force limit [N] in words; None: no limit."""
    until = "" if limit is None else f", or until it takes {limit:.3g} N"
    return f"by {1e3 * distance:.3g} mm at {1e3 * speed:.3g} mm/s{until}"


def check_from_now(memory: Memory, engine: Engine, *, force_sum: float, interval: float) -> None:
    """Note in the memory of a stage that a force is checked now, and again after an interval [s].

    `force_sum` is the force on what moves, summed over all steps [N].
    """
    memory.update(force_sum=force_sum, step=engine.steps, due=engine.time + interval)


def stop_at_limit(memory: Memory, engine: Engine, *, force_sum: float, limit: float | None) -> None:
    """End the travel now, and the phase soon, if the mean force since the last check exceeds a limit [N].

    `force_sum` is as in `check_from_now`, and negative where the force acts against the travel. In the memory `arrival`
    and `end` are the times at which the travel and the phase end [s].
    """
    if limit is not None and memory["force_sum"] - force_sum > limit * (engine.steps - memory["step"]):
        memory.update(arrival=engine.time, end=engine.time + HELD_SECONDS)


def travel_left(memory: Memory, engine: Engine, *, limit: float | None) -> float:
    """Return the time [s] until the travel ends, or until the next check if there is a limit; 0 at its end."""
    left = time_left(engine, memory["arrival"])
    return left if limit is None else min(max(memory["due"] - engine.time, engine.time_step), left)
