"""Find the memory that this process may still use, which a batch system or a container may limit."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

#: Files of a group of processes: limit and use [bytes], and the key of `memory.stat` of what can be freed at once
_FILES = {
    "": ("memory.max", "memory.current", "inactive_file"),  # version 2
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),  # version 1
}


def free_memory(*, proc: Path = Path("/proc"), groups: Path = Path("/sys/fs/cgroup")) -> int | None:
    """Return the memory that can still be used [bytes]; None where the system does not report it.

    `proc` and `groups` are where Linux shows processes and groups of processes (cgroups, either version).
    """
    found = [*_of_machine(proc), *_of_groups(proc, groups)]
    return max(0, min(found)) if found else None


def _of_machine(proc: Path) -> Iterator[int]:
    with suppress(OSError, ValueError):
        for line in (proc / "meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                yield 1024 * int(line.split()[1])


def _of_groups(proc: Path, groups: Path) -> Iterator[int]:
    """Yield what the limits of this process's groups leave; each group of a group has a limit of its own."""
    with suppress(OSError, ValueError):
        for line in (proc / "self" / "cgroup").read_text(encoding="utf-8").splitlines():
            _, controllers, path = line.split(":", 2)
            kind = "memory" if "memory" in controllers.split(",") else controllers
            if kind not in _FILES:
                continue
            top = groups / kind
            own = top / path.lstrip("/")
            # In a container the own group is shown as the top one.
            for group in [own, *own.parents] if own != top else [top]:
                yield from _of_group(group, *_FILES[kind])
                if group == top:
                    break


def _of_group(group: Path, limit: str, used: str, reclaimed: str) -> Iterator[int]:
    with suppress(OSError, ValueError):  # no limit ("max"), or no such file
        free = int((group / limit).read_text()) - int((group / used).read_text())
        stat = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
        yield free + int(stat.get(reclaimed, 0))
