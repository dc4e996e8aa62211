"""Warn about values that are allowed, and more often mistakes: angles in radians, piles like columns, edges."""

import math
from collections.abc import Iterator
from typing import Any

from dem.scene.reading import flattened
from dem.scene.scene import Scene

# Angles of bodies and swings of barbs; as degrees, values below π leave bodies straight and barbs at rest.
_LARGE = ("angle_deg", "angles_deg", "theta_deg", "amplitude_deg")
_ROUND, _NEAR = 5.0, 0.3  # deg; a number of radians that was meant is this near to a multiple of that
# Below this restitution dashpots are so strong that friction exceeds Coulomb's where a load grows, see docs/theory.md.
_STICKY = 0.3
_TALLEST = 4.5  # heights of poured piles over their width [1]; those of the shipped scenes with default walls reach 4.1


def doubts_of(scene: Scene) -> Iterator[str]:
    """Yield a warning for each value of a scene that is probably a mistake: key, value, what to do."""
    yield from _of_angles(scene)
    yield from filter(None, [scene.sections.overhang(scene.fidelity.rows)])
    restitution = scene.contact.restitution
    if restitution < _STICKY:
        yield (
            f"contact.restitution: at {restitution:g} tangential dashpots, which friction does not limit, may hold "
            f"bodies that should slide, by more than twice Coulomb's limit, and piles may not come to rest; use "
            f"{_STICKY:g} or more"
        )
    if scene.phases[0].pours and scene.container.height_m is None:
        radius = scene.container.radius_m
        slenderness = scene.loose_height / (2 * radius)
        if slenderness > _TALLEST:
            yield (
                f"count: {scene.count} bodies in container.radius_m = {radius:g} m become a column of about "
                f"{scene.loose_height:.2g} m, {slenderness:.2g} times as high as wide, in a wall of "
                f"{scene.cylinder.height:.3g} m; for a pile use a radius of {radius * math.cbrt(slenderness):.2g} m, "
                f"or at most {max(1, int(scene.count / slenderness))} bodies"
            )


def _of_angles(scene: Scene) -> Iterator[str]:
    for key, value in flattened(scene.given).items():
        words = key.split(".")
        name = next((word for word in reversed(words) if word.endswith("_deg")), None)
        if name is None:
            continue
        # Joints of chains and filaments bend by few degrees.
        large = name in _LARGE and (words[0] != "phases" or scene.particle is None)
        for angle in value if isinstance(value, list) else [value]:
            if meant := _meant(angle, large=large):
                yield f"{key}: {angle:g} means {angle:g}°, since angles are in degrees; for {angle:g} rad write {meant}"


def _meant(angle: Any, *, large: bool) -> str:
    """Return the angle in degrees that was probably meant by a number in radians; "" if degrees were meant.

    `large` says that small angles in degrees have no use.
    """
    if not isinstance(angle, int | float) or not 0 < abs(angle) <= 2 * math.pi:
        return ""
    degrees = math.degrees(angle)
    rounded = _ROUND * round(degrees / _ROUND)
    in_halves = angle % 0.5 == 0  # as degrees are usually given
    if abs(degrees - rounded) <= _NEAR and (large or not in_halves):
        return f"{rounded:g}"
    return f"{degrees:.3g}" if large and abs(angle) <= math.pi else ""
