"""Public names of the package. A module is imported when one of its names is first used.

    import smarticles

    scene = smarticles.Scene(seed=1, count=20, fidelity="draft", engine="links", phases=[{"type": "deposit"}])
    done = smarticles.run(scene, "runs/a")
    done.series["com_height_m"], done.frames[-1].vertices, smarticles.measure(done)
    smarticles.measures.link_crossings(done.frames[-1].vertices)
    smarticles.plot(done)
    many = smarticles.sweep(scene, "ratios", vary={"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2]})
    many.table(by="aspect_ratio")

The command line is `smarticles.main`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dem.errors import InputError, RunError
    from dem.record.run import Run
    from dem.scene.reading import load_scene
    from dem.scene.scene import Scene
    from smarticles import measures
    from smarticles.public import SweepDirectory, measure, plot, read, read_sweep, run, sweep

    __version__: str

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
    "plot",
    "read",
    "read_sweep",
    "run",
    "sweep",
]

_MODULES = {
    "InputError": "dem.errors",
    "Run": "dem.record.run",
    "RunError": "dem.errors",
    "Scene": "dem.scene.scene",
    "load_scene": "dem.scene.reading",
}
"""Modules of the names that `smarticles.public` does not define."""


if not TYPE_CHECKING:  # hidden from type checkers, which would accept any name

    def __getattr__(name: str) -> object:
        if name == "measures":
            value: object = import_module("smarticles.measures")
        elif name == "__version__":
            from importlib.metadata import version  # noqa: PLC0415  (slow to import)

            value = version("smarticles")
        elif name in __all__:
            value = getattr(import_module(_MODULES.get(name, "smarticles.public")), name)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}; known: {', '.join(sorted(__all__))}")
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
