"""Smarticles: what a user imports. Nothing is loaded before it is used.

    import smarticles

    scene = smarticles.Scene(seed=1, count=20, fidelity="draft", engine="links", phases=[{"type": "deposit"}])
    done = smarticles.run(scene, "runs/a")
    done.series["com_height_m"], done.frames[-1].vertices, smarticles.measure(done)
    smarticles.measures.link_crossings(done.frames[-1].vertices)
    many = smarticles.sweep(scene, "ratios", vary={"smarticle.aspect_ratio": [0.4, 0.7], "seed": [1, 2]})
    many.table(by="aspect_ratio")

The command line is `smarticles.main`. Types of these names are in `__init__.pyi`.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    "InputError": "dem.errors",
    "Run": "dem.record.run",
    "RunError": "dem.errors",
    "SweepDirectory": "smarticles.public",
    "Scene": "dem.scene.scene",
    "load_scene": "dem.scene.reading",
    "measure": "smarticles.public",
    "read": "smarticles.public",
    "read_sweep": "smarticles.public",
    "run": "smarticles.public",
    "sweep": "smarticles.public",
}
"""Public name: module that has it."""

__all__ = [*_HOMES, "__version__", "measures"]  # noqa: PLE0604  (a list of strings, as a test says)


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
    elif name == "measures":
        value = import_module("postprocess")
    elif name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415  (slow to import)

        value = version("smarticles")
    else:
        msg = f"module {__name__!r} has no attribute {name!r}; known: {', '.join(sorted(__all__))}"
        raise AttributeError(msg)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
