"""Clusters as data, and requests that one cannot give."""

from pathlib import Path

import pytest

from dem.errors import InputError
from templates.slurm.cluster import Cluster, format_time, load_cluster, parse_time, shipped_clusters
from templates.slurm.job import Request, Wishes, plan_request

FILE = """\
schema_version = 1
name = "mine"
scheduler = "slurm"
max_array_size = 100
signal_lead_s = 120
default_partition = "long"

[partitions.long]
cores_per_node = 16
memory_per_node_mib = 32000
max_time = "1-00:00:00"

[partitions.short]
cores_per_node = 8
memory_per_node_mib = 8000
max_time = "00:30:00"
"""


def write(folder: Path, text: str = FILE) -> str:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


@pytest.fixture
def cluster(tmp_path: Path) -> Cluster:
    return load_cluster(write(tmp_path))


def test_a_byte_order_mark_is_no_part_of_a_cluster_file(tmp_path: Path, cluster: Cluster) -> None:
    assert load_cluster(write(tmp_path, "\ufeff" + FILE)) == cluster


@pytest.mark.parametrize("name", shipped_clusters())
def test_shipped_clusters_are_valid(name: str) -> None:
    assert load_cluster(name).name == name


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("max_array_size", "max_aray_size", "^[^ ]*: unknown key 'max_aray_size'; did you mean 'max_array_size'?"),
        ('name = "mine"', "", "name: missing"),
        ('"1-00:00:00"', '"a day"', "'a day' is not a time; write D-HH:MM:SS"),
        ('= "long"', '= "logn"', "default_partition: there is no 'logn'; did you mean 'long'?"),
        ('name = "mine"', 'name = "my cluster"', "name: 'my cluster' would need quoting in a job script; use letters"),
        ('name = "mine"', 'name = "m"\nmodules = ["a; rm -rf /"]', "modules.0: .*rm -rf"),
        ('name = "mine"', 'name = "m"\noptions = ["--x\\n#SBATCH --y"]', "options.0: "),
        ("schema_version = 1", "schema_version = ", "not valid TOML: .*line 1"),
    ],
)
def test_bad_cluster_files_are_input_errors(old: str, new: str, message: str, tmp_path: Path) -> None:
    assert old in FILE
    with pytest.raises(InputError, match=message) as caught:
        load_cluster(write(tmp_path, FILE.replace(old, new, 1)))
    assert "mine.toml: " in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("90", 5400), ("1:30", 90), ("01:00:00", 3600), ("2-0", 172800), ("1-02:03", 93780), ("1-02:03:04", 93784)],
)
def test_times_are_read_as_slurm_reads_them(text: str, seconds: int) -> None:
    assert parse_time(text) == seconds
    assert parse_time(format_time(seconds)) == seconds


@pytest.mark.parametrize("text", ["", "1h", "-5", "1:2:3:4", "0", "00:00", "1-", "1-2:3:4:5", "1.5", "١"])
def test_other_times_are_rejected(text: str) -> None:
    with pytest.raises(ValueError, match="time"):
        parse_time(text)


def planned(cluster: Cluster, count: int = 40, expected: float = 3600.0, **wishes: object) -> Request:
    return plan_request([expected] * count, cluster, Wishes(**wishes))  # type: ignore[arg-type]


def test_runs_fill_nodes_evenly(cluster: Cluster) -> None:
    assert (planned(cluster).tasks, planned(cluster).runs_per_task) == (3, 14)
    assert (planned(cluster, 3).tasks, planned(cluster, 3).runs_per_task) == (1, 3)
    # Memory lets no more than five runs into a node.
    short = planned(cluster, partition="short", memory_mib=1500)
    assert (short.tasks, short.runs_per_task, short.memory_mib) == (8, 5, 7500)


def test_time_is_what_is_expected_with_a_margin(cluster: Cluster) -> None:
    assert planned(cluster).time_s == 3 * 3600 + 120
    assert planned(cluster, expected=1.0).time_s == 600 + 120
    # A run that needs longer than the partition gives goes on after the limit.
    longer = planned(cluster, expected=86400.0)
    assert longer.time_s == 86400
    assert longer.requeues == 8
    assert planned(cluster).requeues == 3
    assert planned(cluster, time="00:10:30").time_s == 660


@pytest.mark.parametrize(
    ("wishes", "message"),
    [
        ({"time": "1-00:01:00"}, "--time 1-00:01:00: partition long of mine allows 1-00:00:00"),
        ({"time": "soon"}, "--time: 'soon' is not a time"),
        ({"time": "2"}, "--time 2: runs are asked to stop 120 s before the end"),
        ({"runs_per_task": 17}, "--runs-per-task 17: partition long of mine has 16 cores"),
        ({"runs_per_task": 16, "memory_mib": 2001}, "16 × 2001 MiB are more than the 32000 MiB"),
        ({"ranks": 4, "runs_per_task": 2}, "--runs-per-task 2: a run on 4 ranks is alone in its task"),
        ({"partition": "lng"}, "--partition lng: cluster mine has no such partition; did you mean 'long'?"),
    ],
)
def test_requests_beyond_the_limits_are_rejected(cluster: Cluster, wishes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        planned(cluster, **wishes)  # type: ignore[arg-type]


def test_a_run_on_many_ranks_has_as_many_nodes_as_that_takes(cluster: Cluster) -> None:
    assert (planned(cluster, ranks=1).tasks, planned(cluster, ranks=1).nodes) == (3, 1)
    full, more = planned(cluster, 3, ranks=16), planned(cluster, 3, ranks=17)
    assert (full.tasks, full.runs_per_task, full.ranks, full.nodes) == (3, 1, 16, 1)
    assert (more.tasks, more.runs_per_task, more.ranks, more.nodes) == (3, 1, 17, 2)
    assert "3 tasks of 1 run on 17 ranks: 2 nodes, 1024 MiB on each" in more.to_text()
    image = load_cluster("example-apptainer")
    cores = image.partition(None)[1].cores
    assert planned(image, 1, ranks=cores).nodes == 1
    with pytest.raises(InputError, match=rf"^--ranks {cores + 1}: .* from an image mpirun reaches no other node"):
        planned(image, 1, ranks=cores + 1)


def test_an_array_of_exactly_the_limit_is_given_and_one_more_is_not(cluster: Cluster) -> None:
    assert planned(cluster, 100, runs_per_task=1).tasks == 100
    with pytest.raises(InputError, match=r"101 runs, 1 per task, make an array of 101 tasks; mine allows 100"):
        planned(cluster, 101, runs_per_task=1)
