"""Read the description of a cluster from a file: partitions, limits, modules, container."""

import os
import re
import tomllib
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, ValidationError, field_validator, model_validator

from dem.errors import InputError, nearest
from dem.strict import Strict, explained
from templates.sweep.sweep_file import read_text

SHIPPED = Path(__file__).parent / "clusters"


# Slurm reads these values without a shell, so none may need quoting.
def _plain_word(text: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._+/:@=,-]*", text):
        raise ValueError(f"{text!r} would need quoting in a job script; use letters, digits and . _ + / : @ = , - only")
    return text


def _plain_option(text: str) -> str:
    if not re.fullmatch(r"--[a-z][A-Za-z0-9._+/:@=,&|*%\[\]-]*", text):
        msg = f"{text!r} is no option of sbatch that can be written without quoting; write it as --name=value"
        raise ValueError(msg)
    return text


Word = Annotated[str, Field(max_length=200), AfterValidator(_plain_word)]
Option = Annotated[str, Field(max_length=200), AfterValidator(_plain_option)]


def parse_time(text: str) -> int:
    """Return a time [s] from Slurm's notation: `M`, `M:S`, `H:M:S`, `D-H`, `D-H:M` or `D-H:M:S`.

    ValueError if the text is no such time, or the time is 0.
    """
    days, dash, rest = text.rpartition("-")
    parts = rest.split(":")
    names = {1: "h", 2: "hm", 3: "hms"} if dash else {1: "m", 2: "ms", 3: "hms"}
    fits = all(re.fullmatch(r"[0-9]{1,6}", part) for part in [*parts, *([days] if dash else [])])
    if not fits or len(parts) not in names:
        raise ValueError(f"{text!r} is not a time; write D-HH:MM:SS, HH:MM:SS or minutes")
    factor = {"h": 3600, "m": 60, "s": 1}
    seconds = int(days or 0) * 86400
    seconds += sum(int(part) * factor[name] for part, name in zip(parts, names[len(parts)], strict=True))
    if seconds == 0:
        raise ValueError(f"{text!r} is a time of 0; give at least one minute")
    return seconds


def format_time(seconds: float) -> str:
    """Return a time [s] as text `D-HH:MM:SS`, or `HH:MM:SS` for less than a day."""
    days, rest = divmod(round(seconds), 86400)
    clock = f"{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"
    return f"{days}-{clock}" if days else clock


class Partition(Strict):
    """One partition (queue) of a cluster.

    The cores or the memory of a node may be given as "here": those of the machine that submits.
    """

    cores_per_node: int | Literal["here"]
    memory_per_node_mib: int | Literal["here"]  #: Memory of one node [MiB]
    max_time: str  #: Longest wall time of a job, in Slurm's notation
    named: bool = Field(default=True, description="false: leave --partition out, Slurm takes its default")

    @field_validator("cores_per_node", "memory_per_node_mib", mode="before")
    @classmethod
    def _is_amount(cls, value: object) -> object:
        if value != "here" and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
            msg = f'{value!r} is no whole number from 1; give one, or "here" for that of the machine that submits'
            raise ValueError(msg)
        return value

    @field_validator("max_time")
    @classmethod
    def _is_time(cls, text: str) -> str:
        parse_time(text)
        return text

    @property
    def max_time_s(self) -> int:
        """Longest wall time of a job [s]."""
        return parse_time(self.max_time)

    @property
    def cores(self) -> int:
        """Number of cores of one node."""
        return (os.cpu_count() or 1) if self.cores_per_node == "here" else self.cores_per_node

    @property
    def memory_mib(self) -> int:
        """Memory of one node [MiB]."""
        if self.memory_per_node_mib != "here":
            return self.memory_per_node_mib
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20


class Container(Strict):
    """An Apptainer image whose run script is `smarticles`."""

    image: str = Field(min_length=1)
    command: tuple[str, ...] = Field(default=("apptainer", "run"), min_length=1)


class Cluster(Strict):
    """Description of a cluster, for job scripts."""

    schema_version: Literal[1]
    name: Word
    description: str = ""
    scheduler: Literal["slurm"]
    max_array_size: int = Field(ge=1, description="MaxArraySize of `scontrol show config`")
    signal_lead_s: int = Field(ge=2, le=65535, description="between the signal and the time limit [s]")
    default_partition: str
    partitions: dict[Word, Partition] = Field(min_length=1)
    account: Word | None = None
    qos: Word | None = None
    options: tuple[Option, ...] = Field(default=(), description="further options of sbatch")
    modules: tuple[Word, ...] = ()
    container: Container | None = None
    template: str | None = Field(default=None, description="Jinja2 file that extends slurm.sh.j2; beside this file")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.default_partition not in self.partitions:
            advice = nearest(self.default_partition, sorted(self.partitions))
            raise ValueError(f"default_partition: there is no {self.default_partition!r}; {advice}")
        return self

    def partition(self, name: str | None) -> tuple[str, Partition]:
        """Return name and data of a partition (None: the default); raise InputError for an unknown name."""
        wanted = name or self.default_partition
        if wanted not in self.partitions:
            advice = nearest(wanted, sorted(self.partitions))
            raise InputError(f"--partition {wanted}: cluster {self.name} has no such partition; {advice}")
        return wanted, self.partitions[wanted]


def shipped_clusters() -> list[str]:
    """Return the names of the clusters described in this package."""
    return sorted(path.stem for path in SHIPPED.glob("*.toml"))


def load_cluster(reference: str) -> Cluster:
    """Read a cluster by its name in this package, or from a `.toml` file; raise InputError if invalid."""
    own = reference.endswith(".toml")
    if not own and reference not in shipped_clusters():
        advice = nearest(reference, shipped_clusters())
        raise InputError(f"--cluster {reference}: is not known; {advice} or give a file of your own, FILE.toml")
    path = Path(reference) if own else SHIPPED / f"{reference}.toml"
    try:
        content = tomllib.loads(read_text(path, "cluster file"))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}; correct the file") from error
    try:
        cluster = Cluster.model_validate(content)
    except ValidationError as error:
        msg = f"{path}: {explained(error, content, described=str(SHIPPED / 'example-large.toml'))}"
        raise InputError(msg) from error
    if cluster.template is not None:
        cluster = cluster.model_copy(update={"template": str(path.parent / cluster.template)})
    return cluster
