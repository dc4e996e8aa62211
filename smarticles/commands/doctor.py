"""Command `doctor`: test which parts of the software are installed and work.

YADE, PyVista and the other packages are tested in separate processes, so that a crash does not end the command.
"""

import argparse
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from dem.errors import InputError
from dem.terminal import say
from smarticles.command_line import Commands, add_options
from smarticles.starters import path_of

EXTRAS = {
    **dict.fromkeys(("matplotlib", "PIL", "pyvista", "vtk", "vtkmodules", "imageio_ffmpeg"), "viz"),
    **dict.fromkeys(("trame", "trame_vtk", "trame_client", "trame_server", "aiohttp", "wslink"), "view"),
    **dict.fromkeys(("trimesh", "gsd"), "export"),
    **dict.fromkeys(("sklearn", "emcee", "SALib"), "calibrate"),
}
"""Extra of the project that installs a module; other modules come with the project itself."""

LAMMPS_TESTED = "29 Sep 2021 - Update 2"  # Debian 12's
_TIMEOUT_S = 120
_LEAST_GIB = 1.0  # memory and disk space that one run needs

# Each script prints version and result, or exits with a message about the failure.
_YADE = """
import sys
from dem.engine.yade.library import import_yade
yade = import_yade()
from yade import utils, wrapper
scene = wrapper.Omega()
scene.reset()
ball = scene.bodies.append(utils.sphere((0, 0, 0), 1e-3))
scene.engines = [wrapper.ForceResetter(), wrapper.NewtonIntegrator(damping=0, gravity=(0, 0, -9.81))]
scene.dt = 1e-3
scene.run(10, True)
speed = -scene.bodies[ball].state.vel[2]
found = f"{yade.config.version}, {yade.__path__[0]}"
if not 0.08 < speed < 0.12:
    sys.exit(f"{found}: a sphere falls at {speed:.3g} m/s after 0.01 s, not 0.1 m/s; see environment.md")
print(f"{found}; a sphere falls")
"""
_LINKS = """
import sys, numba
from dem.engine.links.cache import folder
if numba.njit(lambda a, b: a + b)(1, 2) != 3:
    sys.exit("Numba computes nonsense")
kept = f"compiled code in {folder()}" if folder() else "compiled code cannot be kept"
print(f"Numba {numba.__version__}; {kept}")
"""
_LAMMPS = f"""
import sys
from dem.engine.lammps.child import Child, lammps_version
version = lammps_version()
child = Child(1)
child.send("print executed file executed")
executed = (child.scratch / "executed").exists()
child.close()
if not executed:
    sys.exit(f"{{version}} does not execute a command")
tested = {LAMMPS_TESTED!r}
print(f"{{version}}, under mpirun" + ("" if version == tested else f"; the engine was tested with {{tested}}"))
"""
# Draws a sphere; an empty picture would have no contrast.
_PYVISTA = """
import sys, pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere())
contrast = plotter.screenshot(return_img=True).std()
window = plotter.render_window.GetClassName()
plotter.close()
if contrast < 1:
    sys.exit(f"{window} draws an empty picture")
vtk = ".".join(map(str, pyvista.vtk_version_info))
print(f"{pyvista.__version__}, VTK {vtk}; draws off-screen, {window}")
"""
_NEEDED = {
    **{name: name for name in ("numpy", "scipy", "h5py", "meshio", "pydantic", "rich", "pandas")},
    **{"yaml": "PyYAML", "jinja2": "Jinja2"},
}
_OPTIONAL = {**{name: name for name in ("matplotlib", "trimesh", "gsd", "trame", "aiohttp")}, "PIL": "pillow"}


# Kinds of phases for which code is compiled: description, example scene, changes.
_LEDGER = "recording.dissipation_interval_s=0.001"
_COMPILED = (
    ("pour, rest, shake", "shaken", ()),
    ("motors", "actuated", ()),
    ("pour, rest, shake; dissipation recorded", "shaken", (_LEDGER,)),
    ("motors; dissipation recorded", "actuated", (_LEDGER,)),
    ("hooks", "hook", ()),
    ("hooks, motors", "hook", ("phases.1={type: shape-change}",)),
    ("wall that is lifted", "melting", ("phases.3.speed_m_per_s=0.1",)),
    ("tiers, motors", "casting", ()),
    ("chain of robots, strings", "chain", ("fidelity.rows=1",)),
    ("filaments", "worms", ()),
    ("filaments; dissipation recorded", "worms", (_LEDGER,)),
    ("chains of links", "snakes", ()),
    ("chains of links; dissipation recorded", "snakes", (_LEDGER,)),
)


@dataclass(frozen=True, kw_only=True)
class Check:
    """Result of the test of one part of the software."""

    name: str
    ok: bool  #: Whether the part works
    needed: bool  #: Whether a run needs the part
    found: str  #: Version and location, or the cause of the failure
    way_out: str = ""  #: What to do about a failure


def add(commands: Commands) -> None:
    """Add `doctor` to the command line."""
    doctor = commands.add(
        "doctor",
        examine,
        summary="test which of YADE, LAMMPS, PyVista, Slurm … are installed and work",
        text="""
Each part is used once, not just searched for. The exit status is 1 if a part that every run needs
fails; the output then says what to do.

--compile compiles the code of the engine links for all kinds of phases, and stores the code for later
runs: once for the image of a node, or for a new machine. It takes minutes.""",
        examples="""\
  smarticles doctor
  smarticles doctor --compile
  smarticles doctor --json
""",
    )
    doctor.add_argument("--compile", action="store_true", help="compile the engine links for all kinds of phases")
    add_options(doctor, "--json")


def way_to_install(module: str) -> str:
    """Return the command that installs a missing module."""
    extra = EXTRAS.get(module.partition(".")[0])
    name = f"'smarticles[{extra}]'" if extra else "smarticles"
    return f"install it: pip install {name}, or `make setup` in the repository"


def examine(arguments: argparse.Namespace) -> int:
    """Print all checks; return 0 if every part that a run needs works, otherwise 1."""
    if arguments.compile:
        if arguments.json:
            raise InputError("--compile: cannot be combined with --json; leave one of them out")
        return compile_links()
    found = []
    for check in checks():
        found.append(check)
        if not arguments.json:
            state = "ok" if check.ok else "FAILS" if check.needed else "no"
            say(f"{check.name:<15} {state:<5} {check.found}")
            if check.way_out:
                say(f"{'':<15} {'':<5} way out: {check.way_out}")
    failed = [check.name for check in found if check.needed and not check.ok]
    if arguments.json:
        print(json.dumps({"ok": not failed, "checks": [asdict(check) for check in found]}, indent=2))
    else:
        print(f"runs need these, which fail: {', '.join(failed)}" if failed else "everything that a run needs works")
    return 1 if failed else 0


def compile_links() -> int:
    """Compile the code of the engine `links` for all kinds of scenes, such as shaken piles and hooks.

    Returns the exit status: 0 if compiled code is stored on disk, where later runs find it; otherwise 1.
    """
    try:
        from dem.engine.links.cache import folder  # noqa: PLC0415
    except ImportError as error:
        print(f"links: FAILS: {error}; {way_to_install('numba')}")
        return 1
    from dem.run.warm import compile_for  # noqa: PLC0415
    from dem.scene.reading import load_scene  # noqa: PLC0415

    where = folder()
    if where is None:
        return 1  # the cause has been printed
    before, begun = set(where.glob("*.code")), time.process_time()
    for kinds, starter, changes in _COMPILED:
        already, start = set(where.glob("*.code")), time.process_time()
        compile_for(load_scene(path_of(starter), changes))
        new = len(set(where.glob("*.code")) - already)
        done = f"{new} kernels compiled in" if new else "was compiled before; loaded in"
        print(f"{kinds:<44}{done} {time.process_time() - start:.1f} s of processor time", flush=True)
    after = set(where.glob("*.code"))
    took = f"{time.process_time() - begun:.1f} s of processor time"
    print(f"{len(after - before)} kernels compiled in {took}; {len(after)} are stored in {where}")
    return 0 if after else 1


def checks() -> Iterator[Check]:
    """Yield the results of all checks one by one; all together take a few seconds."""
    yield Check(name="python", ok=True, needed=True, found=f"{platform.python_version()}, {sys.executable}")
    links = _check(
        "links", *_run_script(_LINKS), f"only scenes with `engine: links` need it; {way_to_install('numba')}"
    )
    # YADE is optional if the links engine works.
    way_out = (
        "scenes with `engine: yade`, or without the key engine, cannot run; `make setup` installs YADE, see "
        "environment.md; scenes with `engine: links` run without it"
    )
    yield _check("yade", *_run_script(_YADE), way_out, needed=not links.ok)
    yield links
    yield _check(
        "lammps", *_run_script(_LAMMPS), "only scenes with `engine: lammps` need it; `make setup-mpi` installs it"
    )
    for module, name in {**_NEEDED, **_OPTIONAL}.items():
        version = f"import {module}, importlib.metadata; print(importlib.metadata.version({name!r}))"
        yield _check(name, *_run_script(version), way_to_install(module), needed=module in _NEEDED)
    yield _check(
        "pyvista", *_run_script(_PYVISTA), f"only pictures need it; {way_to_install('pyvista')}; see environment.md"
    )
    yield _check("slurm", *slurm(), "only `sweep --submit slurm` needs it; use `--submit local` on this machine")
    cores = f"{len(os.sched_getaffinity(0))} usable of {os.cpu_count()}"
    yield Check(name="cores", ok=True, needed=True, found=cores)
    yield _check("memory", *memory(), f"free memory until {_LEAST_GIB:g} GiB are available", needed=True)
    way_out = f"work in a folder that can be written and has {_LEAST_GIB:g} GiB free, or give its path with --out"
    yield _check("disk", *disk(Path.cwd()), way_out, needed=True)


def _check(name: str, ok: bool, found: str, way_out: str, *, needed: bool = False) -> Check:
    return Check(name=name, ok=ok, needed=needed, found=found, way_out="" if ok else way_out)


def slurm() -> tuple[bool, str]:
    """Return whether Slurm's controller answers, and a text with Slurm's version."""
    if shutil.which("sbatch") is None or shutil.which("scontrol") is None:
        return False, "no sbatch"
    version = "sbatch is installed"
    try:
        # Without a slurm.conf, `sbatch --version` fails although Slurm is installed.
        version = _output("sbatch", "--version")
        _output("scontrol", "ping")
    except (OSError, subprocess.SubprocessError):
        return False, f"{version}, its controller does not answer; try `scontrol ping`"
    return True, f"{version}, its controller answers"


def memory() -> tuple[bool, str]:
    """Return whether the available memory suffices for one run, and a text with the amount."""
    lines = (line.split() for line in Path("/proc/meminfo").read_text("ascii").splitlines())
    gib = {words[0].rstrip(":"): int(words[1]) / 2**20 for words in lines}
    found = f"{gib['MemAvailable']:.1f} GiB available of {gib['MemTotal']:.1f} GiB"
    return gib["MemAvailable"] >= _LEAST_GIB, found


def disk(folder: Path) -> tuple[bool, str]:
    """Return whether a folder can hold a run directory, and a text with the free space."""
    free = shutil.disk_usage(folder).free / 2**30
    found = f"{free:.1f} GiB free in {folder}"
    try:
        # Files of a run are written under a temporary name and renamed.
        with tempfile.TemporaryDirectory(dir=folder, prefix=".doctor-") as scratch:
            written = Path(scratch, "written")
            written.write_text("content", "ascii")
            written.replace(Path(scratch, "renamed"))
    except OSError as error:
        return False, f"{found}, cannot be written: {error.strerror}"
    return free >= _LEAST_GIB, found


def _run_script(script: str) -> tuple[bool, str]:
    """Run a Python script in a new process; return whether it succeeded, and the last line of its output."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", script],
            check=False,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.DEVNULL,
            timeout=_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {_TIMEOUT_S} s"
    if child.returncode < 0:
        return False, f"killed by {signal.Signals(-child.returncode).name}"
    output = child.stderr if child.returncode else child.stdout
    return not child.returncode, (output.strip().splitlines() or [f"exit status {child.returncode}"])[-1]


def _output(*command: str) -> str:
    """Return the output of a command; CalledProcessError if it fails."""
    return subprocess.run(command, check=True, capture_output=True, encoding="utf-8", timeout=10).stdout.strip()
