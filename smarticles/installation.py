"""``smarticles doctor``: what of the software that a run needs is installed and works.

YADE, PyVista and the other packages are tried in processes of their own: nothing that they bring,
not even a crash, reaches this one.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

_TIMEOUT_S = 120
_GIB = 2**30
LAMMPS_TRIED = "29 Sep 2021 - Update 2"  # Debian 12's
_LEAST_MEMORY_GIB = 1.0
_LEAST_DISK_GIB = 1.0

# Module: (its distribution, whether a run needs it).
_PACKAGES = {
    "numpy": ("numpy", True),
    "scipy": ("scipy", True),
    "h5py": ("h5py", True),
    "meshio": ("meshio", True),
    "pydantic": ("pydantic", True),
    "yaml": ("PyYAML", True),
    "jinja2": ("Jinja2", True),
    "rich": ("rich", True),
    "pandas": ("pandas", False),
    "matplotlib": ("matplotlib", False),
    "PIL": ("pillow", False),
}

# One sphere falls for ten steps.
_YADE = """
import json
from dem.engine.yade.library import import_yade
yade = import_yade()
from yade import utils, wrapper
scene = wrapper.Omega()
scene.reset()
ball = scene.bodies.append(utils.sphere((0, 0, 0), 1e-3))
scene.engines = [
    wrapper.ForceResetter(),
    wrapper.NewtonIntegrator(damping=0, gravity=(0, 0, -9.81)),
]
scene.dt = 1e-3
scene.run(10, True)
answer = {
    "version": yade.config.version,
    "path": yade.__path__[0],
    "speed": -scene.bodies[ball].state.vel[2],
}
print()
print(json.dumps(answer))
"""

# Whether Numba compiles here, and where the compiled engine is kept.
_LINKS = """
import json
import numba
from dem.engine.links.compiler import folder
answer = {"version": numba.__version__, "sum": numba.njit(lambda a, b: a + b)(1, 2), "folder": str(folder() or "")}
print()
print(json.dumps(answer))
"""

# LAMMPS under mpirun, on one rank: it starts, and obeys.
_LAMMPS = """
import json
from dem.engine.lammps.child import Child, lammps_version
answer = {"version": lammps_version()}
child = Child(1)
child.send("print obeyed file obeyed")
answer["obeyed"] = (child.scratch / "obeyed").exists()
child.close()
print()
print(json.dumps(answer))
"""

# A sphere before a plain background: an empty picture has no contrast.
_PYVISTA = """
import json
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere())
picture = plotter.screenshot(return_img=True)
answer = {
    "version": pyvista.__version__,
    "vtk": ".".join(map(str, pyvista.vtk_version_info)),
    "window": plotter.render_window.GetClassName(),
    "contrast": float(picture.std()),
}
plotter.close()
print()
print(json.dumps(answer))
"""

_VERSION = """
import importlib, importlib.metadata, json
importlib.import_module({module!r})
print()
print(json.dumps({{"version": importlib.metadata.version({distribution!r})}}))
"""


@dataclass(frozen=True, kw_only=True)
class Probe:
    """What was found about one thing.

    Attributes:
        name: the thing.
        ok: whether it is there and works.
        needed: whether a run needs it.
        found: version and place, or the cause of the failure.
        way_out: what to do if it does not work; empty if it does.
    """

    name: str
    ok: bool
    needed: bool
    found: str
    way_out: str = ""

    @property
    def state(self) -> str:
        """The word for the table."""
        if self.ok:
            return "ok"
        return "FAILS" if self.needed else "no"


def doctor(json_output: bool) -> int:
    """Print what is installed and works.

    Args:
        json_output: JSON in place of a table.

    Returns:
        Exit status: 0 if everything that a run needs works, otherwise 1.
    """
    checks: list[Probe] = []
    for check in examine():
        checks.append(check)
        if not json_output:
            print(_row(check), flush=True)
    failed = [check.name for check in checks if check.needed and not check.ok]
    if json_output:
        print(json.dumps({"ok": not failed, "checks": [asdict(check) for check in checks]}, indent=2))
    elif failed:
        print(f"a run needs what fails here: {', '.join(failed)}")
    else:
        print("everything that a run needs works")
    return 1 if failed else 0


def examine() -> Iterator[Probe]:
    """All checks, one after the other; they take a few seconds."""
    yield Probe(
        name="python",
        ok=True,
        needed=True,
        found=f"{platform.python_version()}, {sys.executable}",
    )
    links = check_links()
    # One engine is enough; only scenes that name the other one need that.
    yield check_yade(needed=not links.ok)
    yield links
    yield check_lammps()
    for module, (distribution, needed) in _PACKAGES.items():
        yield check_package(module, distribution, needed=needed)
    yield check_pyvista()
    yield check_slurm()
    yield check_cores()
    yield check_memory()
    yield check_disk(Path.cwd())


def check_yade(*, needed: bool = True) -> Probe:
    """Whether YADE imports and moves a sphere.

    Args:
        needed: whether there is no other engine.
    """
    way_out = "`make setup` installs it, see environment.md; scenes with `engine: links` run without it"
    answer = _ask(_YADE)
    if isinstance(answer, str):
        return Probe(name="yade", ok=False, needed=needed, found=answer, way_out=way_out)
    found = f"{answer['version']}, {answer['path']}"
    if not 0.08 < answer["speed"] < 0.12:
        return Probe(
            name="yade",
            ok=False,
            needed=needed,
            found=f"{found}: a sphere falls at {answer['speed']:.3g} m/s after 0.01 s, not 0.1 m/s",
            way_out="install the version that environment.md names",
        )
    return Probe(name="yade", ok=True, needed=needed, found=f"{found}; a sphere falls")


def check_links() -> Probe:
    """Whether the links engine can be compiled, and its code be kept."""
    answer = _ask(_LINKS)
    if isinstance(answer, str) or answer["sum"] != 3:
        found = answer if isinstance(answer, str) else "Numba computes nonsense"
        way_out = "only scenes with `engine: links` need it; install numba as requirements.txt pins it"
        return Probe(name="links", ok=False, needed=False, found=found, way_out=way_out)
    kept = f"compiled code in {answer['folder']}" if answer["folder"] else "compiled code cannot be kept"
    return Probe(name="links", ok=True, needed=False, found=f"Numba {answer['version']}; {kept}")


def check_lammps() -> Probe:
    """Whether LAMMPS starts under mpirun, and does what it is told."""
    answer = _ask(_LAMMPS)
    if isinstance(answer, str) or not answer["obeyed"]:
        found = answer if isinstance(answer, str) else f"{answer['version']} does not do what it is told"
        way_out = "only scenes with `engine: lammps` need it; `make setup-mpi` installs it"
        return Probe(name="lammps", ok=False, needed=False, found=found, way_out=way_out)
    tried = "" if answer["version"] == LAMMPS_TRIED else f"; the engine was tried with {LAMMPS_TRIED}"
    return Probe(name="lammps", ok=True, needed=False, found=f"{answer['version']}, under mpirun{tried}")


def check_pyvista() -> Probe:
    """Whether PyVista draws without a display."""
    answer = _ask(_PYVISTA)
    if isinstance(answer, str) or answer["contrast"] < 1:
        found = answer if isinstance(answer, str) else f"{answer['window']} draws an empty picture"
        return Probe(
            name="pyvista",
            ok=False,
            needed=False,
            found=found,
            way_out="only pictures need it; `make setup` installs it, see environment.md",
        )
    return Probe(
        name="pyvista",
        ok=True,
        needed=False,
        found=f"{answer['version']}, VTK {answer['vtk']}; draws off-screen, {answer['window']}",
    )


def check_package(module: str, distribution: str, *, needed: bool) -> Probe:
    """Whether a Python package imports, and its version."""
    answer = _ask(_VERSION.format(module=module, distribution=distribution))
    if isinstance(answer, str):
        way_out = "`make setup` installs it"
        if not needed:
            way_out += "; measures and figures need it, a run does not"
        return Probe(name=distribution, ok=False, needed=needed, found=answer, way_out=way_out)
    return Probe(name=distribution, ok=True, needed=needed, found=answer["version"])


def check_slurm() -> Probe:
    """Whether jobs can be submitted to Slurm."""
    if shutil.which("sbatch") is None or shutil.which("scontrol") is None:
        return Probe(
            name="slurm",
            ok=False,
            needed=False,
            found="no sbatch",
            way_out="only `sweep --submit slurm` needs it; use `--submit local` on this machine",
        )
    version = "sbatch is installed"
    try:
        # Without a slurm.conf even --version fails: Slurm is installed, as the tests do, but not set up.
        version = _output("sbatch", "--version")
        _output("scontrol", "ping")
    except (OSError, subprocess.SubprocessError):
        return Probe(
            name="slurm",
            ok=False,
            needed=False,
            found=f"{version}, its controller does not answer",
            way_out="try `scontrol ping`, or use `--submit local`",
        )
    return Probe(name="slurm", ok=True, needed=False, found=f"{version}, its controller answers")


def check_cores() -> Probe:
    """How many cores this process may use."""
    usable, present = len(os.sched_getaffinity(0)), os.cpu_count()
    return Probe(name="cores", ok=True, needed=True, found=f"{usable} usable of {present}")


def check_memory() -> Probe:
    """Whether enough memory is free for one run."""
    lines = (line.split() for line in Path("/proc/meminfo").read_text("ascii").splitlines())
    kilobytes = {words[0].rstrip(":"): int(words[1]) for words in lines}
    available = kilobytes["MemAvailable"] * 1024 / _GIB
    total = kilobytes["MemTotal"] * 1024 / _GIB
    ok = available >= _LEAST_MEMORY_GIB
    return Probe(
        name="memory",
        ok=ok,
        needed=True,
        found=f"{available:.1f} GiB available of {total:.1f} GiB",
        way_out="" if ok else f"free memory until {_LEAST_MEMORY_GIB:g} GiB are available",
    )


def check_disk(folder: Path) -> Probe:
    """Whether a run directory can be written in a folder."""
    free = shutil.disk_usage(folder).free / _GIB
    found = f"{free:.1f} GiB free in {folder}"
    way_out = ""
    try:
        # As every file of a run is written: beside, then renamed.
        with tempfile.TemporaryDirectory(dir=folder, prefix=".doctor-") as scratch:
            written = Path(scratch, "written")
            written.write_text("whole", "ascii")
            written.replace(Path(scratch, "renamed"))
    except OSError as error:
        found += f", cannot be written: {error.strerror}"
        way_out = "change to a folder that you may write to, or give its path with --out"
    if not way_out and free < _LEAST_DISK_GIB:
        way_out = f"free space until there is {_LEAST_DISK_GIB:g} GiB, or work on another disk"
    return Probe(name="disk", ok=not way_out, needed=True, found=found, way_out=way_out)


def _row(check: Probe) -> str:
    row = f"{check.name:<15} {check.state:<5} {check.found}"
    return f"{row}\n{'':<15} {'':<5} way out: {check.way_out}" if check.way_out else row


def _ask(script: str) -> dict[str, Any] | str:
    """Run a script whose last line of output is a JSON object; that object, or what went wrong."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    try:
        child = subprocess.run(
            [sys.executable, "-c", script],
            check=False,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            env=environment,
            stdin=subprocess.DEVNULL,
            timeout=_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {_TIMEOUT_S} s"
    if child.returncode < 0:
        return f"killed by {signal.Signals(-child.returncode).name}"
    if child.returncode > 0:
        lines = child.stderr.strip().splitlines()
        return lines[-1] if lines else f"exit status {child.returncode}"
    answer: dict[str, Any] = json.loads(child.stdout.splitlines()[-1])
    return answer


def _output(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, encoding="utf-8", timeout=10).stdout.strip()
