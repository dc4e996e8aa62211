import postprocess as measures
from dem.errors import InputError as InputError
from dem.errors import RunError as RunError
from dem.record.run import Run as Run
from dem.scene.reading import load_scene as load_scene
from dem.scene.scene import Scene as Scene
from smarticles.public import SweepDirectory as SweepDirectory
from smarticles.public import measure as measure
from smarticles.public import read as read
from smarticles.public import read_sweep as read_sweep
from smarticles.public import run as run
from smarticles.public import sweep as sweep

__all__ = [
    "InputError",
    "Run",
    "RunError",
    "Scene",
    "SweepDirectory",
    "__version__",
    "load_scene",
    "measure",
    "measures",
    "read",
    "read_sweep",
    "run",
    "sweep",
]

__version__: str
