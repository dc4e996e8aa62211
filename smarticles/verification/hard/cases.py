"""The table of all cases, each with the size of its short and of its long form."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from smarticles.verification.hard import activity, broken, extremes, violence
from smarticles.verification.hard.check import Check

Size = Literal["short", "long"]


@dataclass(frozen=True)
class Case:
    """One hard case.

    Args:
        name: unique.
        run: makes it in a folder and checks it; in a process where YADE may be loaded.
        short: its size in continuous integration; None: the long form only.
        long: what differs from that in the long form; None: there is no other.
    """

    name: str
    run: Callable[..., list[Check]]
    short: Mapping[str, Any] | None = field(default_factory=dict)
    long: Mapping[str, Any] | None = None

    @property
    def about(self) -> str:
        """What happens in it."""
        return inspect.getdoc(self.run) or ""

    def checks(self, size: Size, out: Path) -> list[Check]:
        """Run it and check it."""
        return self.run(out, **{**(self.short or {}), **((self.long or {}) if size == "long" else {})})


def checked(name: str, size: Size, out: Path) -> tuple[list[Check], float]:
    """The checks of a case, and the wall time [s] that they took; to be called in a worker process by its name."""
    begun = time.monotonic()
    return CASES[name].checks(size, out), time.monotonic() - begun


def _cases() -> list[Case]:
    cases = [
        Case(
            f"drop at 10 m/s, {'articulated' if hinged else 'welded'}",
            violence.drop,
            {"articulated": hinged, "time": 0.1},
            {"time": 0.45},
        )
        for hinged in (False, True)
    ]
    cases += [
        Case("articulated smarticles land", violence.landing, {"time": 0.2}),
        Case("tip through the floor", violence.tip, {"speed": 2.0}),
        Case("deep overlap", violence.overlap, {"time": 0.1}, {"time": 0.5}),
        Case("deep overlap, thrown out", violence.thrown_by_overlap, {"time": 0.1}),
        Case("same place", violence.same_place, {"time": 0.02}),
        Case(
            "shaken at Γ = 10",
            violence.shaken,
            {"count": 6, "seconds": 0.2, "rest": 0.4},
            {"count": 100, "seconds": 2.0, "rest": 1.0},
        ),
        Case("thrown out of the container", violence.thrown_out, {"count": 6, "seconds": 0.5}, {"count": 60}),
        *(
            Case(
                f"mass ratio 1e4, {'heavy on light' if above else 'light on heavy'}, contacts of {stiffness:g} N/m",
                violence.mass_ratio,
                {"heavy_above": above, "stiffness": stiffness, "time": 0.1},
            )
            for above in (False, True)
            for stiffness in (250.0, 1e6)
        ),
    ]
    cases += [
        Case(f"l/w = {ratio:g}", extremes.barbs, {"ratio": ratio, "count": 6}, {"count": 100})
        for ratio in (0.0, 0.05, 2.0)
    ]
    cases += [
        Case("rods that may roll", extremes.rods, {"count": 40, "radius": 0.0117}),
        Case("N = 1", extremes.one),
        Case("checkpoint at the last step", extremes.checkpoint_last),
        Case("N = 2000", extremes.many, None, {"count": 2000, "per_layer": 500, "radius": 0.15}),
        *(
            Case(f"friction {value:g}", extremes.friction, {"value": value, "count": 6}, {"count": 100})
            for value in (0.0, 5.0)
        ),
        *(
            Case(
                f"time step {share:g} of the stable one",
                extremes.step_below,
                {"share": share, "count": 4},
                {"count": 40},
            )
            for share in (0.5, 0.9)
        ),
        *(
            Case(f"time step {share:g} of the stable one", extremes.step_above, {"share": share})
            for share in (1.1, 2.0)
        ),
    ]
    cases += [
        Case("τ_max = 0", activity.no_torque),
        *(
            Case(f"τ_max / 1000, {law}", activity.weak_motors, {"law": law, "count": 6}, {"count": 40})
            for law in ("halt", "stall", "slip")
        ),
        Case("τ_max · 100", activity.strong_motors, {"count": 6}, {"count": 40}),
        Case("no room to straighten", activity.no_room, {"count": 5, "seconds": 0.4}, {"count": 20, "seconds": 1.5}),
        Case("container of radius 0.7 w", activity.jammed, {"count": 5, "seconds": 0.4}, {"count": 20, "seconds": 1.5}),
        Case(
            "hook pulled out of a pile",
            activity.hook,
            {"count": 12, "distance": 0.02, "speed": 0.1, "change": 0.3, "rest": 0.1},
            {"count": 60, "distance": 0.05, "speed": 0.05, "change": 1.0, "rest": 0.5},
        ),
        Case("internal oscillation", activity.oscillation, {"seconds": 3.0}, {"seconds": 60.0}),
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
            cases.append(Case(f"spoilt: {what}, {kind}", broken.spoil, size))
            if what in ("velocity", "spin"):
                cases.append(Case(f"spoilt: {what}, {kind}, some steps before", broken.spoil, {**size, "steps": 5}))
    return [
        *cases,
        Case("spoilt: pile that is heated", broken.heated, {"count": 4, "share": 0.3}),
        Case("spoilt: pile that is kicked", broken.kicked, {"count": 4, "speed": 0.3}),
        Case("spoilt: contacts too soft", broken.soft, {"stiffness": 0.5}),
        Case(
            "spoilt: time step 2 of the stable one",
            broken.wrong_step,
            {"factor": 2.0, "count": 6, "seconds": 0.3},
            {"count": 40},
        ),
        # Welded smarticles chatter and never settle, which takes as long as the pour may wait.
        Case(
            "spoilt: time step 4 of the stable one",
            broken.wrong_step,
            None,
            {"factor": 4.0, "count": 6, "seconds": 0.3},
        ),
        Case("spoilt: late in a run", broken.late),
        *(
            Case(
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


CASES: Mapping[str, Case] = {case.name: case for case in _cases()}
