"""doctor: what of the software that a run needs is installed and works."""

from __future__ import annotations

import argparse

from smarticles.parsing import Commands, add_json


def add(commands: Commands) -> None:
    """Add the command."""
    doctor = commands.add(
        "doctor",
        examine,
        summary="what of YADE, PyVista, Slurm … is installed and works",
        text="""
Tries each part instead of only looking for it. Exit status 1 if something that a run needs fails,
with the way out.""",
        examples="""\
  smarticles doctor
  smarticles doctor --json
""",
    )
    add_json(doctor)


def examine(arguments: argparse.Namespace) -> int:
    """`smarticles doctor`."""
    from smarticles.installation import doctor  # noqa: PLC0415

    return doctor(arguments.json)
