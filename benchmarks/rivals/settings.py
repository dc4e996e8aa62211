"""Which engines there are, and the settings that each is tried at."""

from __future__ import annotations

import importlib.util
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

SHAKE, OSCILLATE = "shake", "internal-oscillation"
ACTIVITIES: Mapping[str, Mapping[str, Any]] = {
    SHAKE: {"frequency_hz": 30.0, "peak_acceleration_g": 2.0},
    OSCILLATE: {"theta_deg": 10.0},
}


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One row of the table.

    Args:
        engine: a key of `ENGINES`.
        name: of the setting.
        shape: what it keeps apart, see `benchmarks.rivals.overlap`.
        activities: that it can do.
        scene: keys of the scene that differ.
        knobs: that are not of the scene.
        costly: whether one seed must do.
    """

    engine: str
    name: str
    shape: str = "boxes"
    activities: Sequence[str] = (SHAKE,)
    scene: Mapping[str, Any] = field(default_factory=dict)
    knobs: Mapping[str, Any] = field(default_factory=dict)
    costly: bool = False

    @property
    def key(self) -> str:
        """Name of files."""
        return re.sub(r"[^0-9a-z.-]+", "_", f"{self.engine}-{self.name}".lower())


@dataclass(frozen=True, kw_only=True)
class Peer:
    """An engine.

    Args:
        title: in tables.
        module: of `benchmarks.rivals` that has its `simulate`.
        needs: package of Python, or program, that it needs.
        package: Debian's, that has that program; empty: it is no program.
    """

    title: str
    module: str
    needs: str
    package: str = ""

    @property
    def missing(self) -> str | None:
        """What is missing, and the way out; None: nothing."""
        if self.package:
            found, way = shutil.which(self.needs) is not None, f"apt-get install {self.package}"
        else:
            found, way = importlib.util.find_spec(self.needs) is not None, "make rivals"
        return None if found else f"{self.title}: left out, {self.needs} is not installed ({way})"


ENGINES: Mapping[str, Peer] = {
    "links": Peer(title="links", module="ours", needs="numba"),
    "yade": Peer(title="YADE", module="ours", needs="dem"),
    "lammps": Peer(title="LAMMPS", module="lammps", needs="lmp", package="lammps"),
    "mujoco": Peer(title="MuJoCo", module="mujoco_boxes", needs="mujoco"),
    "bullet": Peer(title="Bullet", module="bullet", needs="pybullet"),
    "rapier": Peer(title="Rapier", module="rapier", needs="rapier3d"),
}

BOTH = (SHAKE, OSCILLATE)
STIFFNESSES = (2e3, 4e3, 3.2e4, 2.56e5, 2.048e6)  # N/m


def _ours() -> Iterator[Setting]:
    """The named fidelities, and links at ever stiffer contacts: what less overlap costs."""
    for name in ("draft", "standard", "reference"):
        yield Setting(
            engine="links", name=name, shape="strands", activities=BOTH, scene={"engine": "links", "fidelity": name}
        )
    for stiffness in STIFFNESSES:
        stiffer = {"base": "standard", "stiffness_N_per_m": stiffness}
        yield Setting(
            engine="links", name=f"{stiffness / 1e3:g} N/mm", shape="strands", activities=BOTH, costly=stiffness > 1e6,
            scene={"engine": "links", "fidelity": stiffer},
        )  # fmt: skip
    for name in ("draft", "standard", "reference"):
        told = {"engine": "yade", "fidelity": name}
        yield Setting(engine="yade", name=name, shape="spheres", scene=told, costly=name == "reference")
    told = {"engine": "yade", "fidelity": "standard"}
    yield Setting(engine="lammps", name="standard", shape="spheres", scene=told, costly=True)


def _mujoco(time_step: float, contact: float) -> Mapping[str, Any]:
    """Return the solver of the trials; a contact's time constant is 0.02 s as shipped, and 2 dt at least."""
    solver = {"solver": "CG", "iterations": 50, "cone": "pyramidal"}
    return {"time_step": time_step, **solver, "solref": [contact, 1.0]}


def _theirs() -> Iterator[Setting]:
    """As shipped or as tried first; and better: chosen on piles of 60 and 270 for little overlap at little cost."""
    for name, step, contact in (
        ("2e-4 s, CG 50, soft", 2e-4, 0.02),
        ("2e-4 s, CG 50, stiff", 2e-4, 4e-4),
        ("5e-4 s, CG 50, stiff", 5e-4, 1e-3),
    ):
        yield Setting(engine="mujoco", name=name, activities=BOTH, knobs=_mujoco(step, contact), costly=True)
    for name, step, iterations, recovery in (
        ("1e-3 s", 1e-3, 50, 0.2),
        ("1e-3 s, 200 iterations", 1e-3, 200, 0.8),
        ("2e-4 s", 2e-4, 50, 0.2),
    ):
        knobs = {"time_step": step, "iterations": iterations, "recovery": recovery}
        yield Setting(engine="bullet", name=name, knobs=knobs, costly=step < 5e-4)
    for name, step, frequency, damping in (
        ("1e-3 s, as shipped", 1e-3, 30.0, 10.0),
        ("2e-4 s, as shipped", 2e-4, 30.0, 10.0),
        ("1e-3 s, stiff", 1e-3, 1000.0, 5.0),
        ("2e-4 s, stiff", 2e-4, 1000.0, 5.0),
    ):
        knobs = {"time_step": step, "iterations": 4, "frequency": frequency, "damping": damping}
        yield Setting(engine="rapier", name=name, knobs=knobs)


SETTINGS: Sequence[Setting] = (*_ours(), *_theirs())
