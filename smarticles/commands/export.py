"""Command `export`: write a run for other programs and archives, or a scene for LAMMPS."""

import argparse
from functools import partial
from pathlib import Path

from dem.display import progress_of
from dem.errors import InputError, nearest
from smarticles.command_line import Commands, add_options, names

_FORMATS = ("vtp", "gsd", "stl", "obj", "gltf", "glb")
_LAMMPS = "lammps"
_CRATE = "ro-crate"
_KNOWN = (*_FORMATS, _LAMMPS, _CRATE)
_INSTEAD = {
    **dict.fromkeys(("xyz", "extxyz", "dump", "lammpstrj", "pdb", "dcd"), "gsd, a trajectory that OVITO reads"),
    **dict.fromkeys(("vtk", "vtu", "vtkhdf", "pvd"), "vtp, for ParaView"),
    **dict.fromkeys(("ply", "off", "dae", "fbx", "blend"), "glb or obj, for Blender"),
    "3mf": "stl, for 3D printers",
    "csv": "`smarticles measure DIR --frames --table FILE.csv` for measures, or gsd for positions",
}
"""Formats that there are in place of others."""

# Kept here because `postprocess.export`, which has this table too, is slow to import; a test compares both.
_FIELDS = """\
  smarticle_id [-]                     number of the smarticle, constant in all frames
  link [-]                             0 barb 1, 1 middle link, 2 barb 2
  speed_m_per_s [m/s]                  speed of the smarticle's centre of mass
  height_m [m]                         height of the smarticle's centre of mass above the floor
  velocity_m_per_s [m/s]               velocity vector of the link's centre
  angular_velocity_rad_per_s [rad/s]   angular velocity vector of the link
  contacts [-]                         number of other smarticles in contact with the smarticle
  crossings [-]                        number of links of others through the smarticle's plane; mean: ⟨N⟩
  contact_cluster [-]                  number of the cluster of touching smarticles, 0 the largest
  entanglement_cluster [-]             number of the cluster of entangled smarticles, 0 the largest
  local_packing_fraction [-]           volume of the smarticle over its Voronoi cell; slow to compute
on request, as --with average_crossing_number; costs 0.3 µs per pair of links:
  average_crossing_number [-]          with all others, half the crossings seen from a side; mean: ⟨ACN⟩
runs with recording.contact_forces:
  normal_force_N [N]                   sum of the normal forces at the smarticle's contacts
  force_chain [-]                      number of the cluster joined by forces above the mean, 0 the largest
scenes that actuate:
  angle_rad [rad]                      angle of the barb
  motor_torque_N_m [N m]               torque of the motor at the barb's hinge
  motor_work_J [J]                     work of that motor since the start
  halted [-]                           1 if that motor is halted
scenes with the key particle:
  entry [-]                            entry of the scene's list `particle` that the body is made from
  kind [-]                             kind of the body, a place in `kinds` of run.json; one for each size"""

_ON_REQUEST = "crossings, forces, average_crossing_number"


def add(commands: Commands) -> None:
    """Add `export` to the command line."""
    export = commands.add(
        "export",
        export_run,
        summary="write a run for ParaView, OVITO, Blender, 3D printers or an archive, or a scene for LAMMPS",
        text=f"""
Writes the boxes or cylinders of all links, and wall, tiers, floor, hooks, plate and strings at one time, in metres.
Existing files are never replaced. Formats:

  vtp        folder for ParaView with all fields below; run `paraview --script=show_in_paraview.py`
             in the folder, or open the .pvd files
  gsd        one file for OVITO and HOOMD-blue, with all fields below: a capsule for each strand of each
             link, as contacts see it; no other bodies. --all writes all frames into this file
  gltf, glb  coloured by one field, y upwards, for example for Blender; fields without NaN become attributes
  obj        shape and colours
  stl        shape alone
  lammps     folder with a commented input deck. DIR must be a scene file whose first phase is take-over.
             The deck has the poses at rest, the contact law, the time step, and the phases relax, shake
             and remove-container (at once). Other features of a scene are rejected by name.
  ro-crate   DIR/ro-crate-metadata.json, which makes the run directory a Workflow Run RO-Crate (profile
             Process Run Crate 0.5) for archives: program with versions, command, scene, times, files

Bodies: smarticles, wall, floor, hooks, plate, strings. --with crossings adds a point and a direction
where a link passes through another smarticle's plane. --with forces adds lines through the contacts,
for runs with recording.contact_forces.

Fields of each box or cylinder:
{_FIELDS}""",
        examples="""\
  smarticles export runs/a --to glb                        last frame, runs/a/export.glb
  smarticles export runs/a --to vtp --all --with crossings   runs/a/export-vtp, for ParaView
  smarticles export runs/a --to gsd --all                  all frames, runs/a/export.gsd
  smarticles export runs/a --to stl --time 1.5 --without wall,floor --output pile.stl
  smarticles export on.yaml --to lammps                    on-lammps/in.lammps and its data files
  smarticles export runs/a --to ro-crate                   runs/a/ro-crate-metadata.json
""",
    )
    add_options(export, "directory", help="run directory; for lammps a scene file")
    export.add_argument("--to", required=True, metavar="FORMAT", help=", ".join(_KNOWN))
    default = "default: DIR/export.FORMAT or DIR/export-FORMAT; for lammps SCENE-lammps next to the scene"
    add_options(export, "--output", metavar="PATH", help=default)
    add_options(export, "--time")
    export.add_argument(
        "--all", action="store_true", help="export all frames, into a folder of numbered files, or one gsd"
    )
    export.add_argument("--with", dest="wanted", type=names, default=(), metavar="NAME,…", help=_ON_REQUEST)
    export.add_argument(
        "--without", dest="unwanted", type=names, default=(), metavar="NAME,…", help="bodies or fields to leave out"
    )
    colours = "field for the colours of obj, gltf and glb; default: crossings, or smarticle_id for motion in a plane"
    add_options(export, "--color-by", help=colours)


def _export_scene(arguments: argparse.Namespace) -> int:
    from dem.deck import DECK, write_deck  # noqa: PLC0415
    from smarticles.commands.run import read_scene  # noqa: PLC0415

    scene: Path = arguments.directory
    _reject_selection(arguments, "a scene")
    folder: Path = arguments.output or scene.with_name(f"{scene.stem}-{_LAMMPS}")
    try:
        write_deck(read_scene(scene, ()), folder)
    except InputError as error:
        msg = str(error) if str(error).startswith((f"{scene}: ", "--output")) else f"{scene}: {error}"
        raise InputError(msg) from None
    print(f"{folder}: written; run in this folder: lmp -in {DECK}")
    return 0


def _reject_selection(arguments: argparse.Namespace, written: str) -> None:
    for name, value in (
        ("--time", arguments.time),
        ("--all", arguments.all or None),
        ("--with", arguments.wanted or None),
        ("--without", arguments.unwanted or None),
        ("--color-by", arguments.color_by),
    ):
        if value is not None:
            raise InputError(
                f"{name}: selects from the frames of a run, and --to {arguments.to} writes {written}; leave it out"
            )


def _export_crate(arguments: argparse.Namespace) -> int:
    from postprocess.report.crate import describe_run  # noqa: PLC0415

    _reject_selection(arguments, "metadata of the run")
    if arguments.output is not None:
        raise InputError(f"--output: --to {_CRATE} writes into the run directory, which is the crate; leave it out")
    print(describe_run(arguments.directory))
    return 0


def export_run(arguments: argparse.Namespace) -> int:
    """Export a run, or a scene for LAMMPS; return the exit status."""
    if arguments.to == _LAMMPS:
        return _export_scene(arguments)
    if arguments.to == _CRATE:
        return _export_crate(arguments)
    if arguments.to not in _KNOWN:
        instead = _INSTEAD.get(arguments.to.lower().removeprefix("."))
        advice = f"use {instead}" if instead else nearest(arguments.to, _KNOWN)
        raise InputError(f"--to {arguments.to}: no such format; {advice}")
    from postprocess import export  # noqa: PLC0415  (imports PyVista)

    with progress_of("exporting") as progress:
        written = export.export_run(
            arguments.directory,
            to=arguments.to,
            output=arguments.output,
            time=arguments.time,
            every_frame=arguments.all,
            wanted=arguments.wanted,
            unwanted=arguments.unwanted,
            color_by=arguments.color_by,
            progress=partial(progress, "frames exported"),
        )
    print(written)
    return 0
