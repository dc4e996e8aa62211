"""What is simulated: piles poured once on links, and for each an activity by the rules of a protocol, as scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from benchmarks.child import run_child
from dem.record.names import DONE
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

Engine = Literal["chrono", "chrono-warm", "links"]

RULES = ("code", "text")
SHAPE, INTERNAL = "shape", "internal10"
ACTIVITIES: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        SHAPE: {"type": "shape-change", "straight_deg": 0, "opening_s": 1.5, "closing_s": 1.5},
        **{
            f"internal{theta}": {"type": "internal-oscillation", "theta_deg": theta, "duration_s": 5.0, "scaled": True}
            for theta in (10, 30, 5, 15)
        },
    }
)
"""As in the study `procedures`."""
FIRST = (SHAPE, INTERNAL)
"""Activities that all seeds have before any has the others."""

REST = 0.5  # s before and after the activity, as in the study
PER_LAYER = 10
# A round bar as thick as the section's diagonal, as in `benchmarks.rivals`: no boxes overlap in what it pours.
POUR_DIAMETER = 1.37e-3  # m
FRAMES, SERIES = 0.05, 0.005  # s, as in the study


@dataclass(frozen=True, kw_only=True)
class Case:
    """One simulation.

    Args:
        engine: that computes it; chrono-warm: Chrono whose solver begins where it ended in the step before.
        rules: protocol: motors' law, friction, and radius of the wall.
        activity: a key of `ACTIVITIES`.
        seed: of the pile.
        count: smarticles.
    """

    engine: Engine
    rules: str
    activity: str
    seed: int
    count: int

    @property
    def name(self) -> str:
        """Of its directory."""
        return f"{self.engine}-{self.activity}-{self.rules}-{self.count}-{self.seed}"


def planned(engine: Engine, seeds: Sequence[int], activities: Sequence[str], count: int) -> Iterator[Case]:
    """Seed by seed, the code's rule first; what is in `FIRST` of all seeds before the rest.

    Args:
        engine: that computes them.
        seeds: of the piles.
        activities: keys of `ACTIVITIES`.
        count: smarticles.
    """
    for early in (True, False):
        for seed in seeds:
            for activity in activities:
                if (activity in FIRST) == early:
                    for rules in RULES:
                        yield Case(engine=engine, rules=rules, activity=activity, seed=seed, count=count)


def common(rules: str, seed: int, count: int) -> dict[str, Any]:
    """What scenes of a pile have in common; the rest is the protocol's."""
    return {
        "schema_version": 1,
        "name": "beside Chrono",
        "engine": "links",
        "protocol": rules,
        "seed": seed,
        "count": count,
        "contact": {"restitution": 0.7},
    }


def pour(folder: Path, rules: str, seed: int, count: int) -> Path:
    """A pile at rest by the friction and wall of a protocol, as a run directory; kept where it is there already."""
    name = f"pile-{rules}-{count}-{seed}"
    if not (folder / name / DONE).exists():
        phases = [{"type": "deposit", "per_layer": PER_LAYER}, {"type": "relax", "duration_s": 0.3}]
        fidelity = {"base": "standard", "diameter_m": POUR_DIAMETER}
        run_child(folder, name, {**common(rules, seed, count), "fidelity": fidelity, "phases": phases})
    return folder / name


def scene_data(case: Case, pile: Path) -> dict[str, Any]:
    """The scene of a case: take over, rest, act, rest."""
    return {
        **common(case.rules, case.seed, case.count),
        "phases": [
            {"type": "take-over", "run": str(pile.absolute())},
            {"type": "relax", "duration_s": REST},
            dict(ACTIVITIES[case.activity]),
            {"type": "relax", "duration_s": REST},
        ],
        "recording": {"energy": True, "frame_interval_s": FRAMES, "series_interval_s": SERIES},
    }


def scene_of(case: Case, pile: Path) -> Scene:
    """The same, checked."""
    return parse_scene(scene_data(case, pile), source=case.name)
