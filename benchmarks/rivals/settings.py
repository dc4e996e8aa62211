"""The compared engines, and the settings of each."""

import importlib.util
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

SHAKE, OSCILLATE = "shake", "internal-oscillation"
ACTIVITIES: Mapping[str, Mapping[str, Any]] = {
    SHAKE: {"frequency_hz": 30.0, "peak_acceleration_g": 2.0},
    OSCILLATE: {"theta_deg": 10.0},
}


@dataclass(frozen=True)
class Setting:
    """One setting of an engine, a row of the table."""

    engine: str  #: A key of `ENGINES`
    name: str  #: Name of the setting in tables
    shape: str = "boxes"  #: Shape for contacts, see `benchmarks.rivals.overlap.solid_of`
    activities: Sequence[str] = (SHAKE,)  #: Activities that the engine supports
    scene: Mapping[str, Any] = field(default_factory=dict)  #: Changed keys of the scene
    knobs: Mapping[str, Any] = field(default_factory=dict)  #: Parameters of the engine that a scene does not have
    costly: bool = False  #: Whether only the first seed is simulated

    @property
    def key(self) -> str:
        """Name of the setting in file names."""
        return re.sub(r"[^0-9a-z.-]+", "_", f"{self.engine}-{self.name}".lower())


@dataclass(frozen=True)
class Rival:
    """A compared engine."""

    title: str  #: Name in tables
    module: str  #: Module of `benchmarks.rivals` that simulates a task
    needs: str  #: Required Python package, or program of a Debian package
    package: str = ""  #: Debian package; empty for Python packages

    @property
    def missing(self) -> str | None:
        """Message about the missing package and its installation; None if nothing is missing."""
        found = shutil.which(self.needs) if self.package else importlib.util.find_spec(self.needs)
        way = f"apt-get install {self.package}" if self.package else "make rivals"
        return None if found else f"{self.title}: left out, {self.needs} is not installed ({way})"


ENGINES: Mapping[str, Rival] = {
    "links": Rival("links", "ours", "numba"),
    "yade": Rival("YADE", "ours", "dem"),
    "lammps": Rival("LAMMPS", "lammps", "lmp", "lammps"),
    "mujoco": Rival("MuJoCo", "mujoco_boxes", "mujoco"),
    "bullet": Rival("Bullet", "bullet", "pybullet"),
    "rapier": Rival("Rapier", "rapier", "rapier3d"),
}

BOTH = (SHAKE, OSCILLATE)
NAMES = ("draft", "standard", "reference")
STIFFNESSES = (2e3, 4e3, 3.2e4, 2.56e5, 2.048e6)  # N/m


def _links(name: str, fidelity: Any, *, costly: bool = False) -> Setting:
    return Setting("links", name, "strands", BOTH, {"engine": "links", "fidelity": fidelity}, costly=costly)


def _mujoco(name: str, time_step: float, contact: float) -> Setting:
    """Return a setting of MuJoCo with a time step [s] and a time constant `contact` of contacts [s].

    MuJoCo's default of the time constant is 0.02 s; its least value is twice the time step.
    """
    solver = {"time_step": time_step, "solver": "CG", "iterations": 50, "cone": "pyramidal"}
    return Setting("mujoco", name, activities=BOTH, knobs={**solver, "solref": [contact, 1.0]}, costly=True)


def _bullet(name: str, time_step: float, iterations: int, recovery: float) -> Setting:
    knobs = {"time_step": time_step, "iterations": iterations, "recovery": recovery}
    return Setting("bullet", name, knobs=knobs, costly=time_step < 5e-4)


def _rapier(name: str, time_step: float, frequency: float, damping: float) -> Setting:
    knobs = {"time_step": time_step, "iterations": 4, "frequency": frequency, "damping": damping}
    return Setting("rapier", name, knobs=knobs)


# Our engines: the named fidelities, and links with stiffer contacts. Other engines: default settings, and settings with
# small overlap at low cost, chosen with piles of 60 and 270.
SETTINGS: Sequence[Setting] = (
    *(_links(name, name) for name in NAMES),
    *(
        _links(
            f"{stiffness / 1e3:g} N/mm", {"base": "standard", "stiffness_N_per_m": stiffness}, costly=stiffness > 1e6
        )
        for stiffness in STIFFNESSES
    ),
    *(
        Setting("yade", name, "spheres", scene={"engine": "yade", "fidelity": name}, costly=name == "reference")
        for name in NAMES
    ),
    Setting("lammps", "standard", "spheres", scene={"engine": "yade", "fidelity": "standard"}, costly=True),
    _mujoco("2e-4 s, CG 50, soft", 2e-4, 0.02),
    _mujoco("2e-4 s, CG 50, stiff", 2e-4, 4e-4),
    _mujoco("5e-4 s, CG 50, stiff", 5e-4, 1e-3),
    _bullet("1e-3 s", 1e-3, 50, 0.2),
    _bullet("1e-3 s, 200 iterations", 1e-3, 200, 0.8),
    _bullet("2e-4 s", 2e-4, 50, 0.2),
    _rapier("1e-3 s, as shipped", 1e-3, 30.0, 10.0),
    _rapier("2e-4 s, as shipped", 2e-4, 30.0, 10.0),
    _rapier("1e-3 s, stiff", 1e-3, 1000.0, 5.0),
    _rapier("2e-4 s, stiff", 2e-4, 1000.0, 5.0),
)
