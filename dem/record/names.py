"""File names of a run directory and numbers of formats, as docs/reference/files.md describes them."""

SCENE = "scene.yaml"
MANIFEST = "run.json"
OF_SWEEP = "sweep.json"  # the manifest of a sweep, which holds run directories; written by `templates.sweep`
DONE = "done.json"
FAILED = "failed.json"
PROGRESS = "progress.json"
LOG = "log.txt"
LOCK = ".lock"
SERIES = "series.h5"
CHECKPOINT = "checkpoint.zip"
CHECKPOINT_BEFORE = "checkpoint.previous.zip"

# Nouns that name the VTK files of centrelines, spheres and forces at contacts; see `collection` and `member`.
FRAME, SPHERE, FORCE = "frame", "sphere", "force"

VTKHDF = "frames.vtkhdf"  # all frames in one file, in the place of `frames.pvd` and its files

SERIES_FORMAT = 1
CHECKPOINT_FORMAT = 4


def folder(noun: str) -> str:
    """Return the name of the folder of numbered files: `frames` for the noun "frame"."""
    return f"{noun}s"


def collection(noun: str) -> str:
    """Return the name of the list of numbered files and their times: `frames.pvd` for the noun "frame"."""
    return f"{noun}s.pvd"


def member(noun: str, number: int) -> str:
    """Return the path of a numbered file: `frames/frame_000000.vtu` for the noun "frame" and 0."""
    return f"{noun}s/{noun}_{number:06d}.vtu"


def partial(name: str) -> str:
    """Return the temporary name of a file while it is written."""
    stem, dot, suffix = name.rpartition(".")
    return f".{stem}.partial{dot}{suffix}" if stem else f".{name}.partial"


def is_partial(name: str) -> bool:
    """Return whether a name is one that `partial` gives; killed processes leave such files behind."""
    return name.startswith(".") and ".partial." in name
