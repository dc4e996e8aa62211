"""Memory that is left, by machine and groups of processes; the number of processes that measure at once."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from command_cases import Smarticles, WriteRun

from dem.record.sizes import MIB
from smarticles import measuring
from smarticles.memory import free_memory

MACHINE = "MemTotal:  16384 kB\nMemFree:  100 kB\nMemAvailable:  8192 kB\n"  # 8 MiB are left
STAT = "anon 5\ninactive_file 100\ntotal_inactive_file 1000\n"


def left(folder: Path, groups: str, files: Mapping[str, str], machine: str = MACHINE) -> int | None:
    (folder / "proc" / "self").mkdir(parents=True)
    (folder / "proc" / "meminfo").write_text(machine)
    (folder / "proc" / "self" / "cgroup").write_text(groups)
    for name, text in files.items():
        path = folder / "groups" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return free_memory(proc=folder / "proc", groups=folder / "groups")


def second(place: str, limit: object, used: int) -> dict[str, str]:
    return {f"{place}memory.max": f"{limit}\n", f"{place}memory.current": f"{used}\n", f"{place}memory.stat": STAT}


@pytest.mark.parametrize(
    ("groups", "files", "bytes_left"),
    [
        ("", {}, 8 * MIB),
        # Version 2: what is cached can be freed.
        ("0::/job/step\n", second("job/step/", 5000, 3000), 2100),
        ("0::/job/step\n", {**second("job/step/", "max", 3000), **second("job/", 4000, 3500)}, 600),
        ("0::/job/step\n", {**second("job/step/", 5000, 3000), **second("job/", 9000, 3500)}, 2100),
        ("0::/\n", second("", 5000, 3000), 2100),  # in a container
        ("0::/job\n", second("job/", 3000, 9000), 0),
        ("0::/job\n", second("job/", "max", 9000), 8 * MIB),
        # Version 1.
        (
            "5:devices:/\n4:cpu,memory:/job\n",
            {
                "memory/job/memory.limit_in_bytes": "7000",
                "memory/job/memory.usage_in_bytes": "5000",
                "memory/job/memory.stat": STAT,
            },
            3000,
        ),
    ],
)
def test_the_least_of_what_machine_and_groups_leave_counts(
    groups: str, files: Mapping[str, str], bytes_left: int, tmp_path: Path
) -> None:
    assert left(tmp_path, groups, files) == bytes_left


def test_a_system_that_does_not_tell(tmp_path: Path) -> None:
    assert left(tmp_path, "nonsense", {}, machine="") is None
    assert free_memory(proc=tmp_path / "absent", groups=tmp_path) is None


def test_processes_share_the_memory(tmp_path: Path, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dem.engine.cores.usable_cores", lambda: 64)
    small, large = (write_run(tmp_path / str(count), count=count) for count in (12, 1000))
    for free, directories, least, most in (
        (None, [small], 64, 64),
        (64 * 2**30, [small], 64, 64),
        (8 * 2**30, [large], 5, 10),  # 1000 smarticles take some 0.8 GiB
        (8 * 2**30, [small, large], 5, 10),
        (8 * 2**30, [small], 25, 45),
        (2**20, [small], 1, 1),
    ):
        monkeypatch.setattr(measuring, "free_memory", lambda free=free: free)
        assert least <= measuring.usual_jobs(directories) <= most


def test_measure_takes_as_many_unless_told_otherwise(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    measured = measuring.measured
    monkeypatch.setattr("smarticles.commands.measure.usual_jobs", lambda _directories: 7)
    monkeypatch.setattr(
        "smarticles.commands.measure.measured",
        lambda *directories, jobs, **options: (asked.append(jobs), measured(*directories, **options))[1],
    )
    run = write_run(tmp_path / "a")
    assert smarticles("measure", run).status == 0
    assert smarticles("measure", run, "--jobs", "3").status == 0
    assert asked == [7, 3]
