"""A Slurm of one node on this machine: own folders, own ports, own processes, all gone when the test ends."""

import getpass
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

DAEMONS = ("munged", "slurmctld", "slurmd")
SEARCHED = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"
WAIT_S = 600.0
CORES, MEMORY_MIB = 6, 6000  # as configured; the machine may have fewer

_CONFIGURATION = """\
ClusterName=smarticles-test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={ctld_port}
SlurmdPort={d_port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock,cred_expire=3
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=sched_interval=1,batch_sched_delay=1,bf_interval=5
SlurmdParameters=config_overrides
MpiDefault=none
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=only Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


@dataclass(frozen=True)
class SlurmHere:
    """A running Slurm.

    Args:
        folder: everything it writes.
        environment: with which its commands find it.
    """

    folder: Path
    environment: dict[str, str]

    def ask(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=300, check=False)

    def call(self, *command: str) -> str:
        done = self.ask(*command)
        assert done.returncode == 0, f"{command}: {done.stderr}{done.stdout}"
        return done.stdout

    def logs(self) -> str:
        return "\n".join(path.read_text(errors="replace")[-2000:] for path in self.folder.glob("*.log"))


def require() -> None:
    """Skip, with the reason, where Slurm cannot be started."""
    missing = [name for name in (*DAEMONS, "sbatch", "scontrol") if shutil.which(name, path=SEARCHED) is None]
    if missing:
        pytest.skip(f"Slurm is not installed ({', '.join(missing)}): apt-get install slurm-wlm munge")
    if os.geteuid() != 0:
        pytest.skip("slurmd starts jobs only where it runs as root")


@contextmanager
def slurm_here(folder: Path) -> Iterator[SlurmHere]:
    """Start munged, slurmctld and slurmd; stop them, and only them, in the end."""
    require()
    host = socket.gethostname().partition(".")[0]
    for name in ("state", "spool"):
        (folder / name).mkdir()
    configuration = folder / "slurm.conf"
    with socket.socket() as one, socket.socket() as other:
        one.bind(("127.0.0.1", 0))
        other.bind(("127.0.0.1", 0))
        ports = {"ctld_port": one.getsockname()[1], "d_port": other.getsockname()[1]}
    asked = {"host": host, "user": getpass.getuser(), "folder": folder, "cores": CORES, "memory": MEMORY_MIB}
    configuration.write_text(_CONFIGURATION.format(**asked, **ports))
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o600)
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("SLURM", "SBATCH", "SQUEUE"))}
    here = SlurmHere(folder, {**clean, "PATH": SEARCHED, "SLURM_CONF": str(configuration)})
    munged = [
        *("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={folder / 'munge.sock'}"),
        *(f"--pid-file={folder / 'munged.pid'}", f"--seed-file={folder / 'munged.seed'}"),
        f"--log-file={folder / 'munged.log'}",
    ]
    with ExitStack() as stack:
        stack.enter_context(_daemon(munged, here))
        wait_until((folder / "munge.sock").exists, lambda: "munged makes a socket")
        stack.enter_context(_daemon(["slurmctld", "-D", "-f", str(configuration)], here))
        stack.enter_context(_daemon(["slurmd", "-D", "-f", str(configuration), "-N", host], here))
        wait_until(lambda: here.ask("sinfo", "--noheader", "--format=%t").stdout.strip() == "idle", here.logs)
        yield here
        here.call("scancel", "--user", getpass.getuser())
        wait_until(lambda: not here.call("squeue", "--noheader").strip(), here.logs)


@contextmanager
def _daemon(command: list[str], here: SlurmHere) -> Iterator[None]:
    with (here.folder / f"{command[0]}.output").open("wb") as output:
        process = subprocess.Popen(command, env=here.environment, stdout=output, stderr=output)
        try:
            yield
        finally:
            process.terminate()
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def wait_until(condition: Callable[[], object], what: Callable[[], str]) -> None:
    """Wait for a condition; after ten minutes the test fails, with `what` is wrong."""
    deadline = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > deadline:
            pytest.fail(f"not within {WAIT_S:.0f} s: {what()}")
        time.sleep(0.05)
