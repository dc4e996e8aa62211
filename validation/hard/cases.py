"""The table of all cases, each with the size of its short and of its long form."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from validation.check import Check
from validation.engines import engine_access
from validation.hard import activity, broken, extremes, violence

Size = Literal["short", "long"]

LIGHT_ON_HEAVY = (
    "all smarticles share one mass: a load as heavy that has no inertia of its own shakes off what lies on it; above "
    "it is borne"
)


@dataclass(frozen=True)
class Hard:
    """A hard case.

    Args:
        name: unique.
        run: simulates with the access and in the folder that it is given, and returns checks.
        short: its size in continuous integration; None: the long form only.
        long: what differs from that in the long form.
        absent: why it has no meaning, by engine.
    """

    name: str
    run: Callable[..., list[Check]]
    short: Mapping[str, Any] | None = field(default_factory=dict)
    long: Mapping[str, Any] = field(default_factory=dict)
    absent: Mapping[str, str] = field(default_factory=dict)


def checked(name: str, engine: str, size: Size, out: Path) -> tuple[list[Check], float]:
    """Return the checks of a case and the wall time [s] that they took; for a worker process."""
    begun, one = time.monotonic(), CASES[name]
    options = {**(one.short or {}), **(one.long if size == "long" else {})}
    return one.run(engine_access(engine), out, **options), time.monotonic() - begun


def _cases() -> list[Hard]:
    cases = [
        Hard(
            f"drop at 10 m/s, {'articulated' if hinged else 'welded'}",
            violence.drop,
            {"articulated": hinged, "time": 0.1},
            {"time": 0.45},
        )
        for hinged in (False, True)
    ]
    cases += [
        Hard("articulated smarticles land", violence.landing, {"time": 0.2}),
        Hard("tip through the floor", violence.tip, {"speed": 2.0}),
        Hard("deep overlap", violence.overlap, {"time": 0.1}, {"time": 0.5}),
        Hard("deep overlap, thrown out", violence.thrown_by_overlap, {"time": 0.1}),
        Hard("same place", violence.same_place, {"time": 0.02}),
        Hard(
            "shaken at Γ = 10",
            violence.shaken,
            {"count": 6, "seconds": 0.2, "rest": 0.8},
            {"count": 100, "seconds": 2.0, "rest": 1.0},
        ),
        Hard("thrown out of the container", violence.thrown_out, {"count": 6, "seconds": 0.5}, {"count": 60}),
        *(
            Hard(
                f"mass ratio 1e4, {'heavy on light' if above else 'light on heavy'}, contacts of {stiffness:g} N/m",
                violence.mass_ratio,
                {"heavy_above": above, "stiffness": stiffness, "time": 0.1},
                absent={} if above or stiffness < 1e6 else {"links": LIGHT_ON_HEAVY},
            )
            for above in (False, True)
            for stiffness in (250.0, 1e6)
        ),
    ]
    cases += [
        Hard(f"l/w = {ratio:g}", extremes.barbs, {"ratio": ratio, "count": 6}, {"count": 100})
        for ratio in (0.0, 0.05, 2.0)
    ]
    cases += [
        Hard("rods that may roll", extremes.rods, {"count": 40, "radius": 0.0117}),
        Hard("N = 1", extremes.one),
        Hard("checkpoint at the last step", extremes.checkpoint_last),
        Hard("N = 2000", extremes.many, None, {"count": 2000, "per_layer": 500, "radius": 0.15}),
        *(
            Hard(f"friction {value:g}", extremes.friction, {"value": value, "count": 6}, {"count": 100})
            for value in (0.0, 5.0)
        ),
        *(
            Hard(
                f"time step {share:g} of the stable one",
                extremes.step_below,
                {"share": share, "count": 4},
                {"count": 40},
            )
            for share in (0.5, 0.9)
        ),
        *(
            Hard(f"time step {share:g} of the stable one", extremes.step_above, {"share": share})
            for share in (1.1, 2.0)
        ),
    ]
    cases += [
        Hard("τ_max = 0", activity.no_torque),
        *(
            Hard(f"τ_max / 1000, {law}", activity.weak_motors, {"law": law, "count": 6}, {"count": 40})
            for law in ("halt", "stall", "slip")
        ),
        Hard("τ_max · 100", activity.strong_motors, {"count": 6}, {"count": 40}),
        Hard("no room to straighten", activity.no_room, {"count": 5, "seconds": 0.4}, {"count": 20, "seconds": 1.5}),
        Hard("container of radius 0.7 w", activity.jammed, {"count": 5, "seconds": 0.4}, {"count": 20, "seconds": 1.5}),
        Hard(
            "hook pulled out of a pile",
            activity.hook,
            {"count": 12, "distance": 0.02, "speed": 0.1, "change": 0.3, "rest": 0.1},
            {"count": 60, "distance": 0.05, "speed": 0.05, "change": 1.0, "rest": 0.5},
        ),
        Hard("internal oscillation", activity.oscillation, {"seconds": 3.0}, {"seconds": 60.0}),
    ]
    for what in broken.SPOILT:
        for hinged in (False, True):
            if (what, hinged) in {("hinge", False), ("overlap", True)}:
                continue  # a weld has no hinge to tear; one link put elsewhere tears its hinge first
            kind = "articulated" if hinged else "welded"
            # A hinge's nodes come along with the next step, and its bond is looked at in the one after.
            place = "wall" in what or "floor" in what or what == "hinge"
            steps = 2 if hinged and place else 3 if what == "overlap" else 0
            size = {"what": what, "articulated": hinged, "steps": steps}
            absent = {"links": "hinges cannot part, there is none to tear"} if what == "hinge" else {}
            cases.append(Hard(f"spoilt: {what}, {kind}", broken.spoil, size, absent=absent))
            if what in ("velocity", "spin"):
                cases.append(Hard(f"spoilt: {what}, {kind}, some steps before", broken.spoil, {**size, "steps": 5}))
    return [
        *cases,
        Hard("spoilt: pile that is heated", broken.heated, {"count": 4, "share": 0.3}),
        Hard("spoilt: pile that is kicked", broken.kicked, {"count": 4, "speed": 0.3}),
        Hard("spoilt: contacts too soft", broken.soft, {"stiffness": 0.5}),
        Hard(
            "spoilt: time step 2 of the stable one",
            broken.wrong_step,
            {"factor": 2.0, "count": 6, "seconds": 0.3},
            {"count": 40},
        ),
        # Welded smarticles chatter and never settle, which takes as long as the pour may wait.
        Hard(
            "spoilt: time step 4 of the stable one",
            broken.wrong_step,
            None,
            {"factor": 4.0, "count": 6, "seconds": 0.3},
        ),
        Hard("spoilt: late in a run", broken.late),
        *(
            Hard(
                f"cost of the watchdog, {activity}, {fidelity}",
                broken.cost,
                None,
                {"fidelity": fidelity, "count": 100, "activity": activity, "seconds": 1.0},
            )
            for activity, fidelity in (
                ("at rest", "draft"),
                ("shaken", "draft"),
                ("swinging", "draft"),
                ("at rest", "standard"),
                ("shaken", "standard"),
            )
        ),
    ]


CASES: Mapping[str, Hard] = {case.name: case for case in _cases()}
