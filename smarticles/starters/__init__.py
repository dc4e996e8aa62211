"""Commented example scenes for `smarticles init`: a file per kind, and one for all shapes of bodies."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from dem.errors import InputError, nearest

BODIES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "rod": ("Straight rods", "{shape: rod, length_m: 0.015, diameter_m: 0.001}"),
        "staple": (
            "Staples, whose legs may lean and twist",
            "{shape: staple, crown_m: 0.0117, leg_m: 0.0082, angle_deg: 90, twist_deg: 0}",
        ),
        "z": ("Z shapes", "{shape: z, middle_m: 0.01, arm_m: 0.007, angle_deg: 70}"),
        "s": ("S shapes of two arcs", "{shape: s, radius_m: 0.0035, angle_deg: 200, diameter_m: 0.001}"),
        "hooks": (
            "Hooks, a shank with an arc",
            "{shape: hook, shank_m: 0.01, radius_m: 0.003, angle_deg: 200, diameter_m: 0.001}",
        ),
        "c": ("C shapes", "{shape: c, radius_m: 0.005, opening_deg: 90, diameter_m: 0.001}"),
        "cross": ("Flat crosses", "{shape: cross, arm_m: 0.007}"),
        "star": ("Hexapods", "{shape: star, arms: 6, arm_m: 0.007, diameter_m: 0.001}"),
        "ring": ("Closed rings", "{shape: ring, radius_m: 0.005, diameter_m: 0.001}"),
        "tree": (
            "A body of your own, points and the bars that join them",
            """shape: segments
  points_m: [[0, 0, 0], [0.01, 0, 0], [0, 0.008, 0], [0.01, 0.006, 0], [0.01, 0, 0.007]]
  pairs: [[0, 1], [0, 2], [1, 3], [1, 4]]   # numbers of points, from 0; closed rings are allowed too
  diameter_m: 0.001""",
        ),
        "mixture": (
            "A mixture of staples and rods of different lengths",
            """- {shape: staple, crown_m: 0.0117, leg_m: 0.0082, share: 2}
  - {shape: rod, length_m: 0.012, share: 1, spread: 0.2}   # standard deviation over mean of the lengths""",
        ),
    }
)
"""Descriptions and values of the key `particle`, by kind."""

KINDS = ("shaken", "actuated", "hook", "melting", "casting", "collapse", "chain", "worms", "snakes", *BODIES)
"""Kinds in the order of the help; the first is the default."""


def starter(kind: str) -> str:
    """Return the YAML text of the example scene of a kind; raise InputError for an unknown kind."""
    if kind not in KINDS:
        raise InputError(f"{kind!r} is no kind of scene; {nearest(kind, KINDS)}")
    text = path_of("body" if kind in BODIES else kind).read_text(encoding="utf-8")
    if kind in BODIES:
        description, particle = BODIES[kind]
        values = {"ABOUT": f"{description}: pour, shake, take the wall away.", "NAME": kind, "PARTICLE": particle}
        for word, value in values.items():
            text = text.replace(word, value)
    return text


def path_of(kind: str) -> Path:
    """Return the file of the example scene of a kind."""
    return Path(__file__).with_name(f"{kind}.yaml")


def about(kind: str) -> str:
    """Return a description of the example scene of a kind in one line."""
    return starter(kind).partition("\n")[0].removeprefix("# ")
