"""Find the time steps above which smarticles at rest chatter (keep moving) and simulations blow up.

Scenes reject time steps above the stable step, so the engines are built directly. A few smarticles are released at time
steps from 0.5 to 4 times the stable step. *Chatter*: smarticles that should be at rest move. *Blow-up*: the energy
grows without supply, or positions become NaN. Each setting is run with several seeds, which vary the initial poses.
"""

import math
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses, place_layer
from dem.engine.interface import Engine
from dem.errors import RunError
from dem.plan.steps import stable_step
from dem.scene.scene import Scene
from validation.access import EngineAccess, engine_access
from validation.bench import lying, scene_data, scene_of, shape_change, watched

FACTORS = (0.5, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0)
SETTLE, WATCH = 0.25, 0.05  # time to come to rest, then time of measurement [s]
# Limits of the root-mean-square speed [m/s]. A stack at rest has at most 1e-6. A stack with more than QUIET at half the
# stable step still rolls or topples, and is not evaluated for chatter.
QUIET, CHATTER = 1e-4, 1e-3
BLOW_UP = 1.0  # limit of the excess energy over the energy that lifts all smarticles by a sphere diameter
FACTOR, SPEED, RISE = (
    "factor [1]",
    "speed at rest, root mean square [m/s]",
    "energy from nowhere over lifting by d [1]",
)


@dataclass(frozen=True)
class Setting:
    """Initial configuration of smarticles."""

    placed: str  #: "stack": flat, aligned; "crossed": flat, every second one rotated by 90°; "pile": random
    ratio: float = 0.7  #: Aspect ratio l/w
    fidelity: str = "draft"  #: Draft, standard or reference
    keys: str = ""  #: Further keys of the scene
    count: int = 6  #: Number of smarticles
    articulated: bool = False  #: Hinged links with holding motors; False: welded

    @property
    def name(self) -> str:
        """Name of the configuration in tables."""
        kind = "articulated" if self.articulated else "welded"
        where = f", {self.keys}" if self.keys else ""
        return f"{kind} {self.placed}{where}, l/w = {self.ratio:g}, {self.fidelity}"

    def data(self, access: EngineAccess) -> dict[str, Any]:
        """Return a scene as a dictionary, from which the engine for this configuration is built."""
        phases = [shape_change()] if self.articulated else []
        smarticle = {"aspect_ratio": self.ratio}
        data = scene_data(access, *phases, count=self.count, fidelity=self.fidelity, smarticle=smarticle)
        if self.keys == "at the wall":
            data["container"] = {"radius_m": 1.05 * scene_of(data).body.reach}
        if self.keys == "on hooks":
            data["hooks"] = {}
        return data


SETTINGS: Mapping[str, Setting] = {
    setting.name: setting
    for setting in (
        *(Setting("stack", ratio) for ratio in (0.05, 0.4, 0.7, 1.0, 2.0)),
        *(Setting("stack", fidelity=name) for name in ("standard", "reference")),
        Setting("crossed"),
        Setting("stack", keys="on hooks", count=3),
        *(Setting("pile", ratio) for ratio in (0.7, 2.0)),
        Setting("pile", keys="at the wall", count=4),
        *(Setting("stack", ratio, articulated=True) for ratio in (0.4, 0.7, 1.0)),
        Setting("stack", fidelity="standard", articulated=True),
        Setting("pile", count=4, articulated=True),
        Setting("pile", keys="at the wall", count=3, articulated=True),
    )
}


def poses(setting: Setting, scene: Scene, seed: int) -> Poses:
    """Return the initial poses of all smarticles of a setting; the seed varies them."""
    rng, particle = np.random.default_rng(seed), scene.body
    if setting.placed == "pile":
        narrow, reach = setting.keys == "at the wall", particle.reach
        layers = setting.count if narrow else 1
        placed = [
            place_layer(
                particle,
                count=setting.count // layers,
                radius=scene.cylinder.inner_radius,
                bottom=1e-4 + 2 * reach * k,
                height=2 * reach if narrow else 2 * scene.smarticle.middle_length_m,
                obstacles=np.empty((0, 3)),
                rng=rng,
            )
            for k in range(layers)
        ]
        return Poses(np.concatenate([p.positions for p in placed]), tuple(r for p in placed for r in p.rotations))
    hooks = scene.hooks
    bottom = 0.0 if hooks is None else hooks.upper_height_m + hooks.side_m / 2
    heights = bottom + lying(scene) * (2 * np.arange(setting.count) + 1)
    heights += np.cumsum(rng.uniform(1e-5, 4e-5, setting.count))
    turns = rng.uniform(-0.01, 0.01, setting.count)
    if setting.placed == "crossed":
        turns += np.pi / 2 * (np.arange(setting.count) % 2)
    rotations = tuple(Rotation.from_euler("z", turn) for turn in turns)
    return Poses(np.stack([0 * heights, 0 * heights, heights], axis=1), rotations)


def let_go(access: EngineAccess, setting: Setting, seed: int, factor: float) -> dict[str, Any]:
    """Simulate placed smarticles at `factor` times the stable time step; return a row of the table."""
    data = setting.data(access)
    stable = stable_step(scene_of(data))
    with tempfile.TemporaryDirectory() as scratch:
        scene, engine, _ = watched(data, scratch, dt=factor * stable)
    engine.add(poses(setting, scene, seed))
    if setting.articulated:
        engine.motors.articulate()
    mass = setting.count * scene.smarticle.boxes.mass
    lift = mass * engine.gravity * scene.sphere_diameter
    squares, lowest, rise = [], math.inf, 0.0
    try:
        for time, kinetic, total in _energies(engine, scene):
            lowest = min(lowest, total)
            rise = max(rise, (total - lowest) / lift)
            if time > SETTLE:
                squares.append(2 * kinetic / mass)
            if not rise <= BLOW_UP:
                break
    except RunError:
        rise = math.inf
    return {
        "scene": setting.name,
        "seed": seed,
        "stable step [s]": stable,
        FACTOR: factor,
        SPEED: math.sqrt(np.mean(squares)) if squares else math.nan,
        RISE: rise if math.isfinite(rise) else math.inf,
    }


def _energies(engine: Engine, scene: Scene) -> Iterator[tuple[float, float, float]]:
    """Advance in steps of about 1 ms; yield time [s], kinetic energy and total energy less motor work [J]."""
    dt = engine.time_step
    interval = dt * max(1, round(scene.fidelity.control_interval_s / dt))
    held, updates = engine.state().smarticles.angles, max(1, round(1e-3 / interval))
    while engine.time < SETTLE + WATCH:
        for _ in range(updates):
            if engine.motors.articulated:
                engine.motors.actuate(held[None], interval)
            engine.advance(round(interval / dt))
        state = engine.state().smarticles
        total = state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) + sum(engine.ledger.elastic())
        yield engine.time, state.kinetic_energy, total - engine.motors.work


def climb(engine: str, name: str, seed: int) -> list[dict[str, Any]]:
    """Run the setting `name` with a seed at increasing time steps to the second blow-up; return the rows."""
    rows: list[dict[str, Any]] = []
    for factor in FACTORS:
        rows.append(let_go(engine_access(engine), SETTINGS[name], seed, factor))
        if sum(row[RISE] > BLOW_UP for row in rows) == 2:
            break
    return rows


def onset(name: str, runs: pd.DataFrame) -> dict[str, Any]:
    """Make a setting's row of the table of onsets from its runs, which are rows of `climb`.

    For each seed, the onset is the smallest time step, over the stable step, at which smarticles chatter or the
    simulation blows up; inf if they never do. The row has the least and the greatest onset of all seeds, for chatter
    and for blow-up. A blow-up counts as chatter, too. Chatter is NaN for stacks that still move at half the stable
    step, and for crossed or random smarticles, which may rock at any time step.
    """
    factor, speed, rise = (pd.to_numeric(runs[column], errors="coerce") for column in (FACTOR, SPEED, RISE))
    small, blown = factor <= 0.9, rise > BLOW_UP
    rests = SETTINGS[name].placed == "stack" and not (speed[factor == min(FACTORS)] > QUIET).any()
    row: dict[str, Any] = {
        "scene": name,
        "stable step [s]": runs["stable step [s]"].iloc[0],
        "seeds": runs["seed"].nunique(),
        "speed at rest at 0.9 or less, most [m/s]": speed[small].max(),
        "energy from nowhere at 0.9 or less over lifting by d, most [1]": rise[small].max(),
    }
    for what, found, shown in (("chatter", blown | (speed > CHATTER), rests), ("blow-up", blown, True)):
        first = factor.where(found, math.inf).groupby(runs["seed"]).min()
        row[f"{what} from, least [1]"] = first.min() if shown else math.nan
        row[f"{what} from, most [1]"] = first.max() if shown else math.nan
    return row
