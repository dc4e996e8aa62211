"""export: true bodies of a run as files for other programs; a scene as input of another simulator."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from dem.errors import InputError
from smarticles.command_line import Commands

_FORMATS = ("vtp", "stl", "obj", "gltf", "glb")
_LAMMPS = "lammps"

# One line each; tests hold this table against `postprocess.export`, which is slow to import.
_FIELDS = """\
  smarticle_id [-]                     number of the smarticle, constant in all frames
  link [-]                             0 barb 1, 1 middle link, 2 barb 2
  speed_m_per_s [m/s]                  of the centre of mass
  height_m [m]                         of the centre of mass above the floor
  velocity_m_per_s [m/s]               vector, of the link's centre
  angular_velocity_rad_per_s [rad/s]   vector, of the link
  contacts [-]                         other smarticles that it touches
  crossings [-]                        links of others through its plane; their mean is ⟨N⟩
  contact_cluster [-]                  number of its cluster by contact, 0 the largest
  entanglement_cluster [-]             the same by entanglement
  local_packing_fraction [-]           its volume over that of its Voronoi cell; takes most of the time
  normal_force_N [N]                   sum of the normal forces at its contacts; this and the next where recorded
  force_chain [-]                      number of its cluster by forces above the mean
  angle_rad [rad]                      of a barb; this and the next of scenes that actuate
  motor_torque_N_m [N m]               of the motor at the barb's hinge
  motor_work_J [J]                     of that motor since the start
  halted [-]                           1 where that motor is halted"""


def add(commands: Commands) -> None:
    """Add the command."""
    export = commands.add(
        "export",
        export_run,
        summary="write bodies of a run for ParaView, Blender, printers; a scene for LAMMPS",
        text=f"""
Boxes of all links, wall, tiers, floor, hooks and strings where they are at a time, in metres.
vtp: a folder for ParaView, all fields below in it; open it with `paraview --script=show_in_paraview.py`
there, or open the .pvd files. gltf, glb: y upwards, colours by one field, every field that has a value
everywhere as an attribute; Blender opens it. obj: colours. stl: shape alone. A file that exists is
never replaced.

lammps takes a scene file that begins with take-over, and writes a folder with a commented input deck: its
poses at rest, contact law, time step, and phases relax, shake and remove-container (at once). What cannot be
carried over is rejected by name.

bodies: smarticles, wall, floor, hooks, strings; crossings with --with crossings: a point and a
direction where a link passes through another smarticle's plane; forces with --with forces: lines through
the contacts of a run that records their forces (recording.contact_forces).

fields, of each box:
{_FIELDS}""",
        examples="""\
  smarticles export runs/a --to glb                        last frame, runs/a/export.glb
  smarticles export runs/a --to vtp --all --with crossings   runs/a/export-vtp, for ParaView
  smarticles export runs/a --to stl --time 1.5 --without wall,floor --output pile.stl
  smarticles export on.yaml --to lammps                    on-lammps/in.lammps and what it reads
""",
    )
    export.add_argument("directory", type=Path, metavar="DIR", help="run directory; for lammps a scene file")
    export.add_argument("--to", required=True, metavar="FORMAT", help=", ".join((*_FORMATS, _LAMMPS)))
    export.add_argument(
        "--output",
        type=Path,
        metavar="PATH",
        help="default: DIR/export.FORMAT or DIR/export-FORMAT; for lammps SCENE-lammps beside the scene",
    )
    export.add_argument("--time", type=float, metavar="S", help="simulated time [s], nearest frame; default: end")
    export.add_argument("--all", action="store_true", help="all frames: a folder of numbered files")
    export.add_argument("--with", dest="wanted", type=_names, default=(), metavar="WHAT,…", help="crossings, forces")
    export.add_argument(
        "--without", dest="unwanted", type=_names, default=(), metavar="WHAT,…", help="bodies or fields to leave out"
    )
    export.add_argument(
        "--color-by", metavar="FIELD", help="of obj, gltf and glb; default: crossings, in a plane smarticle_id"
    )


def _names(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _export_scene(arguments: argparse.Namespace) -> int:
    from dem.deck import DECK, write_deck  # noqa: PLC0415
    from smarticles.commands.run import read_scene  # noqa: PLC0415

    scene: Path = arguments.directory
    for name, value in (
        ("--time", arguments.time),
        ("--all", arguments.all or None),
        ("--with", arguments.wanted or None),
        ("--without", arguments.unwanted or None),
        ("--color-by", arguments.color_by),
    ):
        if value is not None:
            raise InputError(f"{name}: is of frames of a run, and --to {_LAMMPS} writes a scene; leave it out")
    folder: Path = arguments.output or scene.with_name(f"{scene.stem}-{_LAMMPS}")
    try:
        write_deck(read_scene(scene, ()), folder)
    except InputError as error:
        msg = str(error) if str(error).startswith((f"{scene}: ", "--output")) else f"{scene}: {error}"
        raise InputError(msg) from None
    print(f"{folder}: run it there: lmp -in {DECK}")
    return 0


def export_run(arguments: argparse.Namespace) -> int:
    """Export a run, or a scene for LAMMPS."""
    if arguments.to == _LAMMPS:
        return _export_scene(arguments)
    from postprocess import export  # noqa: PLC0415  (imports PyVista)

    def show_progress(done: int, number: int) -> None:
        if sys.stderr.isatty() and number > 1:
            print(f"\rframe {done} of {number}", end="\n" if done == number else "", file=sys.stderr, flush=True)

    written = export.export_run(
        arguments.directory,
        to=arguments.to,
        output=arguments.output,
        time=arguments.time,
        every_frame=arguments.all,
        wanted=arguments.wanted,
        unwanted=arguments.unwanted,
        color_by=arguments.color_by,
        progress=show_progress,
    )
    print(written)
    return 0
