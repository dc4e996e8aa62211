"""Plan an array job of Slurm within the limits of a cluster, and render its job script."""

import math
import os
import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Self

import jinja2

from dem.errors import InputError, nearest
from templates.slurm.cluster import Cluster, Partition, format_time, parse_time

TEMPLATES = Path(__file__).parent / "jobs"
SCRIPT, RUN_LIST = "array.sh", "runs.txt"

# Factor from expected to requested time: machines differ by a factor of two, and runs on a node share its memory bus.
TIME_MARGIN = 3.0
LEAST_TIME_S = 600  #: Least requested wall time, to which `Request.lead_s` is added [s]
MEMORY_PER_RUN_MIB = 1024  #: Default memory of a run [MiB]; 1000 smarticles take less than half (`make bench`)
LEAST_REQUEUES = 3  #: Least number of times that a task may return to the queue
CLOSING_S = 30  #: Time between the signal TERM and the time limit [s], at most half of `Request.lead_s`


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """Options of the user; None: the value follows from the cluster and the runs."""

    partition: str | None = None
    account: str | None = None
    time: str | None = None  #: Wall time of a task, in Slurm's notation
    runs_per_task: int | None = None
    memory_mib: int | None = None  #: Memory of a run [MiB]
    ranks: int | None = None  #: Number of processes of a run, one core each

    def completed(self, earlier: Self) -> Self:
        """Return these wishes with those of an earlier job where there is none here.

        A time is for the partition that it was given with, and a number of runs for a task of one rank.
        """
        known = asdict(earlier)
        if self.partition not in (None, earlier.partition):
            del known["time"]
        if self.ranks not in (None, earlier.ranks):
            del known["runs_per_task"]
        return replace(self, **{name: value for name, value in known.items() if getattr(self, name) is None})


@dataclass(frozen=True, kw_only=True)
class Request:
    """Request for an array job; a task computes several runs, one per core, or one run on several ranks."""

    partition: str | None  #: Name of the partition; None: Slurm's default
    account: str | None
    tasks: int  #: Number of tasks
    runs_per_task: int  #: Number of runs, and of cores, of a task; 1 if a run has several ranks
    time_s: int  #: Wall time of a task [s], whole minutes
    memory_mib: int  #: Memory of a task on each node [MiB]
    lead_s: int  #: Time between the signal USR1 and the time limit [s]
    grace_s: int  #: Time between the signals USR1, to end at the next checkpoint, and TERM, to end at once [s]
    requeues: int  #: Number of times that a task may return to the queue
    ranks: int = 1  #: Number of processes of a run, one core each
    nodes: int = 1  #: Number of nodes of a task

    def to_text(self) -> str:
        """Return the request as one line of text."""
        each = f"{self.runs_per_task} runs" if self.runs_per_task > 1 else "1 run"
        where = f"{self.runs_per_task} cores, {self.memory_mib} MiB"
        if self.ranks > 1:
            each += f" on {self.ranks} ranks"
            where = f"{self.nodes} node{'s' if self.nodes > 1 else ''}, {self.memory_mib} MiB on each"
        return f"{self.tasks} tasks of {each}: {where}, {format_time(self.time_s)} each"


def plan_request(expected_s: Sequence[float], cluster: Cluster, wishes: Wishes) -> Request:
    """Return the request for an array job that computes runs with expected wall times [s].

    InputError if it exceeds a limit of the cluster.
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
    # Expected times are for one core, because the speed-up by ranks is unknown.
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
    """Return the number of runs per task, for `count` runs that need a `memory` [MiB] each.

    It is the smaller of `wanted` and `count`; but a `wanted` above the cores of a node is returned unchanged, so that
    the caller can reject it. If `wanted` is None, a task gets as many runs as a node has cores and memory for, or fewer
    if all tasks can then be equal.
    """
    if wanted is not None:
        return wanted if wanted > partition.cores else min(wanted, count)
    most = max(1, min(partition.cores, partition.memory_mib // memory))
    return math.ceil(count / math.ceil(count / most))


def _time(longest: float, cluster: Cluster, partition: Partition, wanted: str | None, where: str) -> int:
    """Return the wall time of a task to request [s], a whole number of minutes, as Slurm counts.

    It is the time `wanted`, or follows from the expected time of the longest run, `longest` [s]. `where` names the
    partition in messages.
    """
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
    """Return the command `smarticles` of this installation with its full path, as words."""
    console = Path(sys.executable).with_name("smarticles")
    if os.access(console, os.X_OK):
        return (str(console),)
    # The source tree is not installed.
    root = str(Path(__file__).resolve().parents[2])
    return ("env", f"PYTHONPATH={root}", sys.executable, "-P", "-m", "smarticles")


def job_name(sweep: str, token: str) -> str:
    """Return a job name: the sweep's without special characters, and a token that makes it unique."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", sweep).strip("-.")[:40]
    return f"{plain or 'sweep'}.{token}"


def render_script(
    cluster: Cluster, request: Request, *, sweep: Path, number: str, name: str, count: int, command: Sequence[str]
) -> str:
    """Return the text of the script of an array job; raise InputError if it cannot be rendered.

    `number` is the name of the submission's folder in `jobs/`, `name` that of the job, `count` the number of runs, and
    `command` starts `smarticles`.
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
