"""Array jobs of Slurm: what is asked of a cluster for some runs, checked against its limits, and the job script."""

from __future__ import annotations

import math
import os
import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import jinja2

from dem.errors import InputError, nearest
from templates.slurm.cluster import Cluster, Partition, format_time, parse_time

TEMPLATES = Path(__file__).parent / "jobs"
SCRIPT, RUN_LIST = "array.sh", "runs.txt"

# Machines differ by a factor of two from the one that costs were measured on, and runs on a node share its memory bus.
TIME_MARGIN = 3.0
LEAST_TIME_S = 600
# A run of 1000 smarticles takes less than half of it (`make bench` measures); --memory changes it.
MEMORY_PER_RUN_MIB = 1024
LEAST_REQUEUES = 3
# Between the signal to end at once and the time limit [s]; half of the lead where that is shorter.
CLOSING_S = 30


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """Options of the user; None leaves a value to the cluster and the runs."""

    partition: str | None = None
    account: str | None = None
    time: str | None = None  #: Wall time, as Slurm writes it
    runs_per_task: int | None = None
    memory_mib: int | None = None  #: Per run [MiB]
    ranks: int | None = None  #: Processes of a run, one core each


@dataclass(frozen=True, kw_only=True)
class Request:
    """An array of tasks, each of which computes several runs at once, one core each; or one run on several ranks."""

    partition: str | None  #: None is Slurm's default
    account: str | None
    tasks: int
    runs_per_task: int  #: Runs, and cores, of a task; one where it has several ranks
    time_s: int  #: Wall time of a task [s], whole minutes
    memory_mib: int  #: Memory of a task on each node [MiB]
    lead_s: int  #: Between the signal and the time limit [s]
    grace_s: int  #: Between the signal and the end of runs that have not reached a checkpoint [s]
    requeues: int  #: How often a task may be put back into the queue
    ranks: int = 1  #: Processes of a run, one core each, on `nodes` nodes
    nodes: int = 1

    def to_text(self) -> str:
        """Return one line for the terminal."""
        each = f"{self.runs_per_task} runs" if self.runs_per_task > 1 else "1 run"
        where = f"{self.runs_per_task} cores, {self.memory_mib} MiB"
        if self.ranks > 1:
            each += f" on {self.ranks} ranks"
            where = f"{self.nodes} node{'s' if self.nodes > 1 else ''}, {self.memory_mib} MiB on each"
        return f"{self.tasks} tasks of {each}: {where}, {format_time(self.time_s)} each"


def plan_request(expected_s: Sequence[float], cluster: Cluster, wishes: Wishes) -> Request:
    """Return what to ask for, for runs of some expected wall times [s].

    Raises:
        InputError: it is more than the cluster gives.
    """
    name, partition = cluster.partition(wishes.partition)
    where = f"partition {name} of {cluster.name}"
    memory, ranks = wishes.memory_mib or MEMORY_PER_RUN_MIB, wishes.ranks or 1
    nodes = math.ceil(ranks / partition.cores)
    runs = _runs_per_task(len(expected_s), partition, 1 if ranks > 1 else wishes.runs_per_task, memory)
    tasks = math.ceil(len(expected_s) / runs)
    given = f"--runs-per-task {runs}"
    msg = ""
    if ranks > 1 and wishes.runs_per_task not in (None, 1):
        msg = f"--runs-per-task {wishes.runs_per_task}: a run on {ranks} ranks is alone in its task; leave it out"
    elif nodes > 1 and cluster.container is not None:
        msg = (
            f"--ranks {ranks}: {where} has {partition.cores} cores per node, and from an image mpirun reaches no other "
            f"node; give at most {partition.cores}, or a cluster without a container"
        )
    elif runs > partition.cores:
        msg = f"{given}: {where} has {partition.cores} cores per node; give at most that many"
    elif runs * memory > partition.memory_mib:
        msg = (
            f"{given}: {runs} × {memory} MiB are more than the {partition.memory_mib} MiB of a node in {where}; "
            "give fewer runs, or less with --memory"
        )
    elif tasks > cluster.max_array_size:
        msg = (
            f"{len(expected_s)} runs, {runs} per task, make an array of {tasks} tasks; {cluster.name} allows "
            f"{cluster.max_array_size}: give a larger --runs-per-task (up to {partition.cores}), or a smaller sweep"
        )
    if msg:
        raise InputError(msg)
    # Costs are those of one core; the gain by ranks is unknown, and left out.
    longest = TIME_MARGIN * max(expected_s)
    time_s = _time(longest, cluster, partition, wishes.time, where)
    return Request(
        partition=name if partition.named else None,
        account=wishes.account or cluster.account,
        tasks=tasks,
        runs_per_task=runs,
        time_s=time_s,
        memory_mib=runs * memory,
        lead_s=cluster.signal_lead_s,
        grace_s=max(cluster.signal_lead_s - CLOSING_S, cluster.signal_lead_s // 2),
        requeues=max(LEAST_REQUEUES, 2 * math.ceil(longest / (time_s - cluster.signal_lead_s))),
        ranks=ranks,
        nodes=nodes,
    )


def _runs_per_task(count: int, partition: Partition, wanted: int | None, memory: int) -> int:
    """Return what is wanted, but no more than there are runs; by default a full node, with tasks of equal size."""
    if wanted is not None:
        return wanted if wanted > partition.cores else min(wanted, count)
    most = max(1, min(partition.cores, partition.memory_mib // memory))
    return math.ceil(count / math.ceil(count / most))


def _time(longest: float, cluster: Cluster, partition: Partition, wanted: str | None, where: str) -> int:
    """Return the wall time to ask for [s]: whole minutes, since Slurm counts in them."""
    if wanted is None:
        needed = max(LEAST_TIME_S, longest) + cluster.signal_lead_s
        time_s = min(60 * math.ceil(needed / 60), partition.max_time_s)
    else:
        try:
            time_s = 60 * math.ceil(parse_time(wanted) / 60)
        except ValueError as error:
            raise InputError(f"--time: {error}") from None
        if time_s > partition.max_time_s:
            raise InputError(
                f"--time {wanted}: {where} allows {partition.max_time}; ask for less: a run that needs longer is "
                "stopped at a checkpoint and queued again"
            )
    if time_s <= cluster.signal_lead_s:
        raise InputError(
            f"--time {wanted or partition.max_time}: runs are asked to stop {cluster.signal_lead_s} s before the end "
            f"(signal_lead_s of {cluster.name}), so nothing would be computed; ask for more"
        )
    return time_s


def smarticles_words() -> tuple[str, ...]:
    """Return the command `smarticles` of this installation, by its full path."""
    console = Path(sys.executable).with_name("smarticles")
    if os.access(console, os.X_OK):
        return (str(console),)
    # A source tree that is not installed.
    root = str(Path(__file__).resolve().parents[2])
    return ("env", f"PYTHONPATH={root}", sys.executable, "-P", "-m", "smarticles")


def job_name(sweep: str, token: str) -> str:
    """Return a name for Slurm: plain letters, and a token by which the job is found again."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", sweep).strip("-.")[:40]
    return f"{plain or 'sweep'}.{token}"


def render_script(
    cluster: Cluster, request: Request, *, sweep: Path, number: str, name: str, count: int, command: Sequence[str]
) -> str:
    """Return the text of an array job's script; what is not plain is quoted for the shell.

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
        raise InputError(
            f"{cluster.template or TEMPLATES}: cannot read the template {error.name!r}; check `template` of the cluster"
        ) from error
    except (jinja2.TemplateError, TypeError, ValueError) as error:
        text = " ".join(str(error).split())
        unknown = re.match(r"'([^']+)' is undefined", text)
        advice = nearest(unknown[1], sorted(values)) if unknown else "correct it"
        raise InputError(f"{cluster.template or TEMPLATES / template}: {text}; {advice}") from error
