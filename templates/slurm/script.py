"""Job scripts: plain text from Jinja2 templates; whatever is not plain is quoted for the shell."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import jinja2

from dem.errors import InputError, nearest
from templates.slurm.cluster import Cluster, format_time
from templates.slurm.request import Request

TEMPLATES = Path(__file__).parent / "jobs"
SCRIPT, RUN_LIST = "array.sh", "runs.txt"


def smarticles_words() -> tuple[str, ...]:
    """The command `smarticles` of this installation, by its full path."""
    console = Path(sys.executable).with_name("smarticles")
    if os.access(console, os.X_OK):
        return (str(console),)
    # A source tree that is not installed.
    root = str(Path(__file__).resolve().parents[2])
    return ("env", f"PYTHONPATH={root}", sys.executable, "-P", "-m", "smarticles")


def job_name(sweep: str, token: str) -> str:
    """A name for Slurm: plain letters, and a token by which the job is found again."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", sweep).strip("-.")[:40]
    return f"{plain or 'sweep'}.{token}"


def render_script(
    cluster: Cluster, request: Request, *, sweep: Path, number: str, name: str, count: int, command: Sequence[str]
) -> str:
    """The text of an array job's script.

    Args:
        cluster: where it is to run.
        request: what it asks for.
        sweep: the sweep's directory.
        number: number of the submission, the name of its folder in `jobs/`.
        name: the job's name.
        count: how many runs it computes.
        command: the words of the command `smarticles`.

    Raises:
        InputError: a template fails, or a path cannot stand in a script.
    """
    folder = f"jobs/{number}"
    where = str(sweep.resolve())
    container = cluster.container
    words = [where, *command, *((container.image, *container.command) if container else ())]
    for word in words:
        if not word.isprintable():
            msg = f"{word!r}: has characters that cannot be printed, such as a line's end; rename it to use job scripts"
            raise InputError(msg)
    if container and re.search("[:,]", where):
        msg = f"{where}: `:` and `,` have a meaning of their own in Apptainer's --bind; rename the directory"
        raise InputError(msg)
    values = {
        **asdict(request),
        "time": format_time(request.time_s),
        "job_name": name,
        "qos": cluster.qos,
        "options": cluster.options,
        "modules": cluster.modules,
        "count": count,
        "sweep": where,
        "folder": folder,
        "script": f"{folder}/{SCRIPT}",
        "list": f"{folder}/{RUN_LIST}",
        "command": shlex.join(command),
        "container_command": shlex.join(container.command) if container else "",
        "container_image": container.image if container else "",
    }
    paths = [TEMPLATES]
    template = "slurm-apptainer.sh.j2" if container else "slurm.sh.j2"
    if cluster.template is not None:
        own = Path(cluster.template)
        paths, template = [own.parent, TEMPLATES], own.name
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(paths),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters["quote"] = shlex.quote
    try:
        return environment.get_template(template).render(values)
    except jinja2.TemplateNotFound as error:
        msg = (
            f"{cluster.template or TEMPLATES}: cannot read the template {error.name!r}; check `template` of the cluster"
        )
        raise InputError(msg) from error
    except (jinja2.TemplateError, TypeError, ValueError) as error:
        text = " ".join(str(error).split())
        unknown = re.match(r"'([^']+)' is undefined", text)
        advice = nearest(unknown[1], sorted(values)) if unknown else "correct it"
        msg = f"{cluster.template or TEMPLATES / template}: {text}; {advice}"
        raise InputError(msg) from error
