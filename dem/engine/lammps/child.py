"""LAMMPS as a child process under `mpirun`: its start, commands and answers, and why it ended."""

from __future__ import annotations

import os
import re
import select
import shutil
import subprocess
import tempfile
import weakref
from functools import lru_cache
from pathlib import Path

from dem.errors import RunError

LMP, MPIRUN = "lmp", "mpirun"
NEEDED = ("rigid/small", "gran/hooke/history", "wall/gran/region", "rigid/local")
"""Styles of LAMMPS that the engine is made of."""
INSTALL = "install it with `make setup-mpi` or `apt-get install lammps openmpi-bin`"
LOG, SAID, ANSWERS = "log.lammps", "mpirun.txt", "answers"
POLL_S = 0.2  # between checks whether a child that does not answer is alive

# As root, as in containers, mpirun does not start without these; for other users they do nothing.
_ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
# It ends when the run is killed: otherwise it would wait for its answer to be read for ever.
_TIED = ("/usr/bin/setpriv", "--pdeathsig", "TERM")
# "--bind-to none": two runs at once would be bound to the same first cores.
_OPTIONS = (*"--bind-to none --mca btl_vader_single_copy_mechanism none --mca mpi_yield_when_idle 1".split(),)


def lammps_version() -> str:
    """Return the version of the LAMMPS that runs.

    Raises:
        RunError: it or mpirun is not installed, does not start, or lacks what the engine is made of.
    """
    for program, what in ((LMP, "LAMMPS"), (MPIRUN, "Open MPI")):
        if shutil.which(program) is None:
            raise RunError(
                f"engine: lammps needs the program {program} of {what}, which is not installed; {INSTALL}, or use "
                "engine: yade (the same spheres) or links"
            )
    return _version(str(shutil.which(LMP)))


@lru_cache
def _version(program: str) -> str:
    try:
        answer = subprocess.run(
            [program, "-h"], check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"{program}: LAMMPS does not start ({error}); {INSTALL}") from None
    found = re.search(r"Simulator - (.+)", answer.stdout)
    if answer.returncode or found is None:
        lines = (answer.stderr or answer.stdout).strip().splitlines()
        raise RunError(f"{program}: is no LAMMPS that starts ({lines[-1] if lines else 'it says nothing'}); {INSTALL}")
    words = set(answer.stdout.split())
    if missing := [style for style in NEEDED if style not in words]:
        raise RunError(
            f"{program}: LAMMPS {found[1]} was built without {', '.join(missing)} (its packages GRANULAR and RIGID); "
            f"{INSTALL}, which has them"
        )
    return found[1].strip()


class Child:
    """A LAMMPS that reads commands, on some ranks, until it is closed or its parent ends.

    Raises:
        RunError: it does not start.
    """

    def __init__(self, ranks: int) -> None:
        self.ranks = ranks
        self.scratch = Path(tempfile.mkdtemp(prefix="smarticles-lammps-"))  #: Folder of files that it reads and writes
        fifo = self.scratch / ANSWERS
        os.mkfifo(fifo)
        # Opened for writing too, so that there is never an end of it.
        self._answers = os.open(fifo, os.O_RDWR | os.O_NONBLOCK)
        self._answer = f'print "done" append {fifo} screen no\n'
        tied = _TIED if Path(_TIED[0]).exists() else ()
        command = [*tied, MPIRUN, *_OPTIONS, "-np", str(ranks), LMP, "-nocite", "-screen", "none", "-log", LOG]
        try:
            with (self.scratch / SAID).open("wb") as said:
                # A session of its own: Ctrl-C is for the run, which then ends it.
                self._process = subprocess.Popen(
                    command,
                    cwd=self.scratch,
                    env={**os.environ, **_ROOT, "OMP_NUM_THREADS": "1"},
                    stdin=subprocess.PIPE,
                    stdout=said,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        except OSError as error:
            shutil.rmtree(self.scratch, ignore_errors=True)
            raise RunError(f"{MPIRUN}: cannot be started ({error.strerror}); {INSTALL}") from None
        self.close = weakref.finalize(self, _end, self._process, self._answers, self.scratch)
        """End it and remove its files; done at the end of the process at the latest."""

    def cpu(self) -> float:
        """Return the processor time [s] of its ranks on this machine; 0 once it has ended."""
        ticks = 0
        for rank in self.local_ranks():
            # After the name, which may hold anything: utime and stime are the 14th and 15th word of all.
            words = _text(Path(f"/proc/{rank}/stat")).rpartition(")")[2].split()
            ticks += sum(map(int, words[11:13]))
        return ticks / os.sysconf("SC_CLK_TCK")

    def local_ranks(self) -> list[int]:
        """Return the process ids of its ranks on this machine, the first one first."""
        number = self._process.pid
        children = map(int, _text(Path(f"/proc/{number}/task/{number}/children")).split())
        return [child for child in children if _text(Path(f"/proc/{child}/comm")).strip() == LMP]

    def send(self, *commands: str) -> None:
        """Send commands, and wait until LAMMPS has carried them out.

        Raises:
            RunError: it ended; the message gives the cause from its log, and the way out.
        """
        text = "\n".join(commands) + "\n" + self._answer
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(text.encode())
            self._process.stdin.flush()
        except (BrokenPipeError, ValueError):
            self._process.wait()
        while not select.select([self._answers], [], [], POLL_S)[0]:
            if self._process.poll() is not None and not select.select([self._answers], [], [], 0)[0]:
                raise RunError(self._why_it_ended())
        os.read(self._answers, 4096)

    def _why_it_ended(self) -> str:
        """Return why it ended, in one line, and keep its log."""
        status = self._process.returncode
        log, said = (_text(self.scratch / name) for name in (LOG, SAID))
        cause, way_out = explain(log, said, status)
        kept = Path(tempfile.mkdtemp(prefix="smarticles-lammps-log-")) / LOG
        kept.write_text(f"{log}\n{said}", encoding="utf-8")
        self.close()
        return f"LAMMPS ended: {cause}; {way_out}; its log: {kept}"


def explain(log: str, said: str, status: int | None) -> tuple[str, str]:
    """Return why LAMMPS ended, and the way out, from its log, what was printed, and mpirun's exit status."""
    errors = re.findall(r"^ERROR(?: on proc \d+)?: (.+)", f"{log}\n{said}", re.MULTILINE)
    if errors:
        cause = re.sub(r"\s*\([^()]*\.(?:cpp|h):\d+\)\s*$", "", errors[0]).strip()
        last = re.findall(r"^Last command: (.+)", f"{log}\n{said}", re.MULTILINE)
        where = f" (command: {' '.join(last[0].split())})" if last else ""
        return cause + where, next((way_out for words, way_out in _WAYS_OUT if re.search(words, cause)), "see its log")
    killed = re.search(r"process rank (\d+) .*?exited on\s+signal (\d+) \(([^)]*)\)", " ".join(said.split()))
    if killed:
        way_out = "go on from the last checkpoint with `smarticles resume`"
        if killed[2] == "9":
            way_out = f"if memory ran out, give it more or use fewer --ranks; {way_out}"
        return f"rank {killed[1]} was ended by signal {killed[2]} ({killed[3]})", way_out
    if "not enough slots" in said:
        return "mpirun finds fewer cores than ranks", "give fewer --ranks"
    lines = [line for line in said.splitlines() if line.strip("- ")]
    return f"exit status {status} ({lines[-1].strip() if lines else 'it says nothing'})", "see its log"


_APART = "smarticles fly apart: lower fidelity.time_step_fraction, or raise fidelity.stiffness_N_per_m"
_WAYS_OUT = (
    ("Lost atoms|Non-numeric|[Oo]ut of range atoms|not exist on|missing", _APART),
    ("memory|allocate", "memory is short: fewer smarticles on this machine, or more machines"),
    ("Unknown|Illegal|Unrecognized|Invalid", f"this LAMMPS does not know what the engine says: {INSTALL} on Debian 12"),
)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _end(process: subprocess.Popen[bytes], answers: int, scratch: Path) -> None:
    """End a child and remove its files."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    if process.stdin is not None:
        try:
            process.stdin.close()
        except OSError:
            pass  # what was not read yet
    os.close(answers)
    shutil.rmtree(scratch, ignore_errors=True)
