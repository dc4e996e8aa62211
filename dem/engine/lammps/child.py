"""LAMMPS as a child process under `mpirun`: start, commands, answers, and the cause of an early end."""

import os
import re
import select
import shutil
import subprocess
import tempfile
import weakref
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from dem.errors import RunError

LMP, MPIRUN = "lmp", "mpirun"
NEEDED = ("rigid/small", "gran/hooke/history", "wall/gran/region", "rigid/local")  #: Styles that LAMMPS must include
INSTALL = "install it with `make setup-mpi` or `apt-get install lammps openmpi-bin`"
LOG, OUTPUT, ANSWERS = "log.lammps", "mpirun.txt", "answers"
POLL_S = 0.2  # s between checks whether a child that has not answered yet is alive

# mpirun needs these to start as root, e.g. in containers; they have no effect for other users.
_ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
# Ends mpirun when the run is killed; otherwise it would wait for ever for its answers to be read.
_END_WITH_PARENT = ("/usr/bin/setpriv", "--pdeathsig", "TERM")
# "--bind-to none": otherwise mpirun would bind the ranks of all runs to the first cores.
_OPTIONS = (*"--bind-to none --mca btl_vader_single_copy_mechanism none --mca mpi_yield_when_idle 1".split(),)


def lammps_version() -> str:
    """Return LAMMPS's version.

    RunError if LAMMPS or mpirun is missing or does not start, or LAMMPS lacks a style in `NEEDED`.
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
        raise RunError(f"{program}: does not start as LAMMPS ({lines[-1] if lines else 'no output'}); {INSTALL}")
    words = set(answer.stdout.split())
    if missing := [style for style in NEEDED if style not in words]:
        raise RunError(
            f"{program}: LAMMPS {found[1]} was built without {', '.join(missing)} (its packages GRANULAR and RIGID); "
            f"{INSTALL}, which has them"
        )
    return found[1].strip()


class Child:
    """A process of LAMMPS on some ranks, which reads commands until it is closed or this process ends.

    RunError if mpirun does not start.
    """

    def __init__(self, ranks: int) -> None:
        self.ranks = ranks
        self.scratch = Path(tempfile.mkdtemp(prefix="smarticles-lammps-"))  #: Folder of LAMMPS's input and output
        fifo = self.scratch / ANSWERS
        os.mkfifo(fifo)
        # Opened for writing as well, so that reading never meets an end of file.
        self._answers = os.open(fifo, os.O_RDWR | os.O_NONBLOCK)
        self._answer = f'print "done" append {fifo} screen no\n'
        prefix = _END_WITH_PARENT if Path(_END_WITH_PARENT[0]).exists() else ()
        command = [*prefix, MPIRUN, *_OPTIONS, "-np", str(ranks), LMP, "-nocite", "-screen", "none", "-log", LOG]
        try:
            with (self.scratch / OUTPUT).open("wb") as output:
                # A session of its own, so that Ctrl-C reaches only this process, which then ends LAMMPS.
                self._process = subprocess.Popen(
                    command,
                    cwd=self.scratch,
                    env={**os.environ, **_ROOT, "OMP_NUM_THREADS": "1"},
                    stdin=subprocess.PIPE,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        except OSError as error:
            shutil.rmtree(self.scratch, ignore_errors=True)
            raise RunError(f"{MPIRUN}: cannot be started ({error.strerror}); {INSTALL}") from None
        self.close = weakref.finalize(self, _end, self._process, self._answers, self.scratch)
        """Function that ends LAMMPS and removes its files, called at the end of this process at the latest."""

    def cpu(self) -> float:
        """Return the processor time of the ranks on this machine [s]; 0 once LAMMPS has ended."""
        ticks = 0
        for rank in self.local_ranks():
            # utime and stime are the 14th and 15th word; the second word, a name in brackets, may hold blanks.
            words = _text(Path(f"/proc/{rank}/stat")).rpartition(")")[2].split()
            ticks += sum(map(int, words[11:13]))
        return ticks / os.sysconf("SC_CLK_TCK")

    def local_ranks(self) -> list[int]:
        """Return the process ids of those ranks that run on this machine."""
        number = self._process.pid
        children = map(int, _text(Path(f"/proc/{number}/task/{number}/children")).split())
        return [child for child in children if _text(Path(f"/proc/{child}/comm")).strip() == LMP]

    def send(self, *commands: str) -> None:
        """Send commands and wait until they are executed; raise RunError with the cause if LAMMPS ends."""
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
        """Return the cause of LAMMPS's end, advice, and the path of the saved log, as a message of one line.

        The log is copied to a new temporary folder, and the folder of LAMMPS's files is removed.
        """
        status = self._process.returncode
        log, output = (_text(self.scratch / name) for name in (LOG, OUTPUT))
        cause, way_out = explain(log, output, status)
        kept = Path(tempfile.mkdtemp(prefix="smarticles-lammps-log-")) / LOG
        kept.write_text(f"{log}\n{output}", encoding="utf-8")
        self.close()
        return f"LAMMPS ended: {cause}; {way_out}; its log: {kept}"


def explain(log: str, output: str, status: int | None) -> tuple[str, str]:
    """Return the cause of LAMMPS's end, and advice to the user.

    `status` is the exit status of mpirun; None if it is unknown.
    """
    errors = re.findall(r"^ERROR(?: on proc \d+)?: (.+)", f"{log}\n{output}", re.MULTILINE)
    if errors:
        cause = re.sub(r"\s*\([^()]*\.(?:cpp|h):\d+\)\s*$", "", errors[0]).strip()
        last = re.findall(r"^Last command: (.+)", f"{log}\n{output}", re.MULTILINE)
        where = f" (command: {' '.join(last[0].split())})" if last else ""
        return cause + where, next((way_out for words, way_out in _WAYS_OUT if re.search(words, cause)), "see its log")
    killed = re.search(r"process rank (\d+) .*?exited on\s+signal (\d+) \(([^)]*)\)", " ".join(output.split()))
    if killed:
        way_out = "go on from the last checkpoint with `smarticles resume`"
        if killed[2] == "9":
            way_out = f"if memory ran out, give it more or use fewer --ranks; {way_out}"
        return f"rank {killed[1]} was ended by signal {killed[2]} ({killed[3]})", way_out
    if "not enough slots" in output:
        return "mpirun finds fewer cores than ranks", "give fewer --ranks"
    lines = [line for line in output.splitlines() if line.strip("- ")]
    return f"exit status {status} ({lines[-1].strip() if lines else 'no output'})", "see its log"


_APART = "bodies fly apart: lower fidelity.time_step_fraction, or raise fidelity.stiffness_N_per_m"
_WAYS_OUT = (
    ("Lost atoms|Non-numeric|[Oo]ut of range atoms|not exist on|missing", _APART),
    ("memory|allocate", "memory is short: fewer bodies on this machine, or more machines"),
    ("Unknown|Illegal|Unrecognized|Invalid", f"this LAMMPS lacks commands of the engine: {INSTALL} on Debian 12"),
)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _end(process: subprocess.Popen[bytes], answers: int, scratch: Path) -> None:
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    if process.stdin is not None:
        with suppress(OSError):  # LAMMPS had not read all commands
            process.stdin.close()
    os.close(answers)
    shutil.rmtree(scratch, ignore_errors=True)
