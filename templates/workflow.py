"""Write the workflow of a sweep for another batch tool: Snakemake, or row of the signac framework.

Sources: https://snakemake.readthedocs.io/en/stable/snakefiles/rules.html, https://row.readthedocs.io
"""

import math
import shlex
from collections.abc import Sequence
from pathlib import Path

import jinja2

from dem.errors import InputError
from dem.record.files import write_text
from templates.slurm.cluster import format_time
from templates.slurm.job import LEAST_TIME_S, MEMORY_PER_RUN_MIB, TIME_MARGIN, smarticles_words
from templates.sweep.folder import Entry, Folder

TOOLS = {"snakemake": "Snakefile", "row": "workflow.toml"}  #: Names of the workflow files by tool
COMMANDS = {"snakemake": "snakemake --cores all --keep-going", "row": "row submit"}  #: Commands that start the runs


def workflow(tool: str, name: str, entries: Sequence[Entry]) -> str:
    """Return the text of the workflow for the runs of a sweep with this name; `tool` is one of `TOOLS`."""
    longest = max(LEAST_TIME_S, TIME_MARGIN * max(entry.expected_s for entry in entries))
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "workflows"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        autoescape=False,
    )
    return environment.get_template(f"{TOOLS[tool]}.j2").render(
        name=" ".join(name.split()),
        command=shlex.join(smarticles_words()),
        memory_mib=MEMORY_PER_RUN_MIB,
        least_s=LEAST_TIME_S,
        margin=TIME_MARGIN,
        walltime=_walltime(60 * math.ceil(longest / 60)),
    )


def _walltime(seconds: int) -> str:
    """Return a time [s] in the notation of the tool row, such as `2 days, 03:00:00`."""
    return format_time(seconds).replace("-", " days, ")


def write_workflow(folder: Folder, tool: str) -> Path:
    """Write the workflow of a sweep into its directory, and return the path.

    InputError if the directory has a file of this name with other content; RunError if the file cannot be written.
    """
    path, text = folder.path / TOOLS[tool], workflow(tool, folder.name, folder.entries)
    if path.exists() and path.read_bytes() != text.encode():
        raise InputError(f"{path}: exists and differs from what --to {tool} writes; use it, or rename it first")
    # Row finds runs by their directories, and the output of each is written to a log.
    for place in (folder.path / "logs", *map(folder.run, folder.entries)):
        place.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
    return path
