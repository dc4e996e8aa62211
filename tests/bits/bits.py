"""Whether two versions of the program compute the same bits: small scenes, run by one and by the other, compared.

    python bits.py make --out before --command "python -m cli" --cwd OLD_CHECKOUT
    python bits.py make --out after --command "python -m smarticles" --cwd NEW_CHECKOUT
    python bits.py compare before after

`make` runs the cases of `bits_scenes.yaml` by the command line alone, so that it drives any version; `compare` lists
what differs in the files and in what was said, and ends with status 1 if any of it is not in `ALLOWED`.
"""

from __future__ import annotations

import argparse
import csv
import difflib
import itertools
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import yaml
from numpy.typing import NDArray

CASES = Path(__file__).with_name("bits_scenes.yaml")
SAID = "said"  # folder of a case with what its commands said
LIMIT_S = 900.0  # longest time of one command
TO_BE_CONTINUED = 75  # exit status of a run that SIGUSR1 stopped


@dataclass(frozen=True)
class Allowed:
    """A difference that is none in what is computed.

    Args:
        files: name pattern of the files, seen from the folder of results; `*` stands for any part of a path.
        what: name pattern of places in them, as `contents` names them; or an expression for the words that are left
            out of texts before they are compared.
        reason: why it may differ.
    """

    files: str
    what: str | re.Pattern[str]
    reason: str

    def __str__(self) -> str:
        what = self.what if isinstance(self.what, str) else f"/{self.what.pattern}/"
        return f"{self.files}: {what}: {self.reason}"


ALLOWED = (
    Allowed("*.json", "*versions.*", "versions and commit of the code"),
    Allowed("*/versions.json", "*", "versions of the code"),
    Allowed("*", re.compile(r"(?<=Versions: ).*"), "versions and commit of the code, how it was called"),
    Allowed("*/provenance.json", "analysed_with.*", "versions of the code"),
    Allowed("*.json", "*command", "how it was called"),
    Allowed("*.json", "*started", "date"),
    Allowed("*/sweep.json", "created", "date"),
    Allowed("*/job.json", "stored", "date"),
    Allowed("*/done.json", "*wall_s", "wall time"),
    Allowed("*/done.json", "*cpu_s", "processor time"),
    Allowed("*-status.json", "*wall_s", "wall time"),
    Allowed("*/checkpoint*.zip", "bytes", "not compared; twins show where it leads"),
    Allowed("*/.lock", "text", "process that ran"),
    Allowed("*/log.txt", re.compile(r"^[-\d]+ [:\d]+,\d+", re.M), "date"),
    Allowed("*/log.txt", re.compile(r"(?<= after )[\d.]+(?= s of wall time$)", re.M), "wall time"),
    Allowed("*.txt", re.compile(r"(?<= simulated in )\d+(?= s$)", re.M), "wall time"),
    Allowed("*.txt", re.compile(r"(?<=(?:done|iled) after )[\d:]+"), "wall time"),
    Allowed("*.txt", re.compile(r"^\d+ of \d+ runs ended.*\n", re.M), "told twice a minute of wall time"),
    Allowed("*-plan.*", re.compile(r"(?<=table: )/\S*(?=/results/accuracy/)"), "where the checkout lies"),
    Allowed("*/array.sh", re.compile(r"(?<=[ (])/\S*(?=/)"), "where the folder and the program lie"),
    Allowed("*/array.sh", re.compile(r"(?<=--job-name=).*"), "bears a hash of where the folder lies"),
    Allowed("*/job.json", "job_name", "bears a hash of where the folder lies"),
    Allowed("accuracy/ladder/results/*.csv", "wall time *", "wall time"),
    Allowed("accuracy/ladder/results/*.csv", "processor time *", "processor time"),
    Allowed("accuracy/ladder/results/accuracy.*", "*", "drawn and told over processor time; tables are compared"),
    Allowed("accuracy/said/02-accuracy.out.txt", "*", "told over processor time; tables are compared"),
)

PACKED = (".vtu", ".h5")  # the same content may have other bytes
SAME_OF_TWINS = ("frames", "spheres", "frames.pvd", "spheres.pvd", "series.h5", "scene.yaml", "done.json")

Value = str | bytes | NDArray[Any]
Difference = tuple[str, tuple[Allowed, ...]]
"""Where and how, for a person; and what says that it may be, empty if nothing does."""


@dataclass(frozen=True, kw_only=True)
class Version:
    """A version of the program.

    Args:
        command: words that start it.
        checkout: the code, first on Python's path; None: what the command finds by itself.
    """

    command: Sequence[str]
    checkout: Path | None

    def start(self, folder: Path, words: Sequence[str], *, hide_commit: bool) -> subprocess.Popen[str]:
        """Start a command in the folder of a case, so that no path in what it writes tells where that is."""
        # One thread: bits depend on their number. The width of help texts is that of the terminal.
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "COLUMNS": "100", "PYTHONDONTWRITEBYTECODE": "1"}
        if self.checkout is not None:
            paths = [str(self.checkout.resolve()), os.environ.get("PYTHONPATH", "")]
            environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
        if hide_commit:
            environment["GIT_DIR"] = os.devnull
        return subprocess.Popen(
            [*self.command, *words],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )


def read_cases(only: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The cases, all or those named, each with all of its files and commands.

    Raises:
        SystemExit: there is no case of a name.
    """
    content = yaml.safe_load(CASES.read_text(encoding="utf-8"))
    cases: dict[str, dict[str, Any]] = content["cases"]
    for name in only:
        if name not in cases:
            sys.exit(f"--only {name}: is no case; known: {', '.join(cases)}")
    for case in cases.values():
        variants = case.get("variants", {})
        case["files"] = dict(case.get("files", {}))
        for name, changes in (variants | ({"scene": case["scene"]} if "scene" in case else {})).items():
            # A key that is null is left out.
            scene = {key: value for key, value in {**content["base"], **changes}.items() if value is not None}
            case["files"][f"{name}.yaml"] = yaml.safe_dump(scene, sort_keys=False)
        case["commands"] = [f"plan {name}.yaml" for name in variants] + case.get("commands", content["standard"])
    return {name: case for name, case in cases.items() if not only or name in only}


def make(version: Version, out: Path, only: Sequence[str]) -> None:
    """Run the cases into folders of their own.

    Raises:
        SystemExit: a case is there already.
    """
    cases = read_cases(only)
    for name in cases:
        if (out / name).exists():
            sys.exit(f"--out {out}: holds {name} already; remove it, or choose another folder")
    for name, case in cases.items():
        started = time.monotonic()
        make_case(version, out / name, case)
        print(f"{time.monotonic() - started:6.1f} s  {name}", flush=True)


def make_case(version: Version, folder: Path, case: Mapping[str, Any]) -> None:
    """Write the files of a case, run its commands, and keep what they say."""
    (folder / SAID).mkdir(parents=True)
    for file, text in case["files"].items():
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    for number, entry in enumerate(case["commands"], 1):
        stopped = isinstance(entry, Mapping)
        words = shlex.split(entry["stop"] if stopped else entry)
        process = version.start(folder, words, hide_commit="hide_commit" in case)
        if stopped:
            _stop(process, folder / words[words.index("--out") + 1] / "frames", entry["frames"])
        try:
            out, err = process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            process.terminate()  # it stops its own processes
            process.communicate()
            sys.exit(f"{folder}: not done after {LIMIT_S:g} s: {shlex.join(words)}")
        if stopped and process.returncode != TO_BE_CONTINUED:
            sys.exit(f"{folder}: ended before it was told to stop, with status {process.returncode}: {err}")
        stem = folder / SAID / f"{number:02d}-{words[0].strip('-') if words else 'nothing'}"
        stem.with_suffix(".json" if "--json" in words else ".out.txt").write_text(out, encoding="utf-8")
        told = f"$ {shlex.join(words)}\nexit status {process.returncode}\n{err}"
        stem.with_suffix(".err.txt").write_text(told, encoding="utf-8")


def _stop(process: subprocess.Popen[str], frames: Path, number: int) -> None:
    """Ask a run to stop at its next checkpoint when it has written so many frames."""
    until = time.monotonic() + LIMIT_S
    while process.poll() is None and time.monotonic() < until:
        if frames.is_dir() and sum(1 for _ in frames.glob("frame_*.vtu")) >= number:
            process.send_signal(signal.SIGUSR1)
            return
        time.sleep(0.002)


def contents(path: Path) -> dict[str, Value]:
    """All that a file holds: values by the names of their places."""
    read = {".vtu": _mesh, ".h5": _series, ".json": _json, ".csv": _table}.get(path.suffix)
    if read is not None:
        return read(path)
    try:
        return {"text": path.read_text(encoding="utf-8")}
    except UnicodeDecodeError:
        return {"bytes": path.read_bytes()}


def _mesh(path: Path) -> dict[str, Value]:
    mesh = meshio.read(path)
    values: dict[str, Value] = {"points": mesh.points}
    values |= {f"cells.{k}.{block.type}": block.data for k, block in enumerate(mesh.cells)}
    values |= {f"point_data.{name}": data for name, data in mesh.point_data.items()}
    return values | {f"{name}.{k}": data for name, parts in mesh.cell_data.items() for k, data in enumerate(parts)}


def _series(path: Path) -> dict[str, Value]:
    with h5py.File(path) as file:
        values: dict[str, Value] = {name: np.asarray(file[name][()]) for name in file}
        for item in (file, *file.values()):
            values |= {f"{item.name.lstrip('/')}@{key}": repr(value) for key, value in item.attrs.items()}
    return values


def _json(path: Path) -> dict[str, Value]:
    try:
        return dict(_leaves(json.loads(path.read_text(encoding="utf-8")), ""))
    except ValueError:
        return {"text": path.read_text(encoding="utf-8")}


def _leaves(data: Any, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(data, dict | list) and data:
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from _leaves(value, f"{place}.{key}".lstrip("."))
    else:
        yield place, json.dumps(data, ensure_ascii=False)


def _table(path: Path) -> dict[str, Value]:
    lines = path.read_text(encoding="utf-8").splitlines()
    header, *rows = csv.reader([line for line in lines if not line.startswith("#")])
    values: dict[str, Value] = {"header": ",".join(header), "rows": str(len(rows))}
    values |= {f"{name} [{k}]": cell for k, row in enumerate(rows) for name, cell in zip(header, row, strict=True)}
    return values | {"comments": "\n".join(line for line in lines if line.startswith("#"))}


def differences(file: str, a: Path, b: Path) -> Iterator[Difference]:
    """What differs between two files, either of which may be absent.

    Args:
        file: their name, for `ALLOWED`.
        a: the one.
        b: the other.
    """
    if not (a.exists() and b.exists()):
        yield "only in A" if a.exists() else "only in B", ()
        return
    if a.read_bytes() == b.read_bytes():
        return
    allowed = [entry for entry in ALLOWED if fnmatchcase(file, entry.files)]
    one, other, same = contents(a), contents(b), True
    for place in dict.fromkeys([*one, *other]):
        fine = tuple(e for e in allowed if isinstance(e.what, str) and fnmatchcase(place, e.what))
        for what, reasons in _compared(one.get(place), other.get(place), allowed):
            same = False
            yield f"{place}: {what}", fine or reasons
    if one.keys() == other.keys() and list(one) != list(other):
        yield "the same places in another order", ()
    elif same and a.suffix not in PACKED:
        yield "other bytes for the same content", ()


def _compared(a: Value | None, b: Value | None, allowed: Sequence[Allowed]) -> Iterator[Difference]:
    if a is None or b is None:
        yield "only in B" if a is None else "only in A", ()
    elif isinstance(a, str) and isinstance(b, str):
        if a != b:
            yield from _lines(a, b, allowed)
    elif isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.dtype != b.dtype or a.shape != b.shape:
            yield f"{a.dtype} {a.shape} | {b.dtype} {b.shape}", ()
        elif a.tobytes() != b.tobytes():
            yield _values(a, b), ()
    elif a != b:
        yield "differ", ()


def _lines(a: str, b: str, allowed: Sequence[Allowed]) -> Iterator[Difference]:
    """Lines that differ when the words that may are left out, and one difference for those words."""
    used = []
    for entry in allowed:
        if isinstance(entry.what, re.Pattern):
            if entry.what.findall(a) != entry.what.findall(b):
                used.append(entry)
            a, b = entry.what.sub("", a), entry.what.sub("", b)
    if used:
        yield "words that may", tuple(used)
    if a != b and "\n" not in a + b:
        yield f"{a} | {b}", ()
    elif a != b:
        changes = difflib.unified_diff(a.splitlines(), b.splitlines(), n=0, lineterm="")
        changed = [line for line in changes if not line.startswith(("--- ", "+++ ", "@@ "))]
        yield from ((line, ()) for line in changed or ["ends of lines"])


def _values(a: NDArray[Any], b: NDArray[Any]) -> str:
    """How many values of two arrays differ in any bit, and the first two that do."""
    one, other = (np.frombuffer(array.tobytes(), np.uint8).reshape(-1, array.dtype.itemsize) for array in (a, b))
    where = np.flatnonzero((one != other).any(axis=1))
    first = np.unravel_index(where[0], a.shape)
    index = ", ".join(str(k) for k in first)
    return f"{len(where)} of {a.size} values differ, the first at [{index}]: {a[first]!r} | {b[first]!r}"


def compare(a: Path, b: Path, only: Sequence[str]) -> int:
    """List what differs between two folders of results, and between the twins in each.

    Returns:
        How many differences are not allowed.
    """
    cases = read_cases(only)
    print(f"A: {a}, commit {_commits(a, cases)}\nB: {b}, commit {_commits(b, cases)}")
    used: Counter[Allowed] = Counter()
    names = _files([a, b], cases)
    refused = sum(_listed(name, differences(name, a / name, b / name), used) for name in names)
    for root in (a, b):
        for name, case in cases.items():
            if "twins" in case:
                one, other = (root / name / twin for twin in case["twins"])
                for file in _files([one, other], SAME_OF_TWINS):
                    found = differences(f"{name}/{file}", one / file, other / file)
                    refused += _listed(f"{one} | {other.name}: {file}", found, used)
    for entry, count in used.items():
        print(f"allowed {count} times: {entry}")
    print(f"{len(names)} files of {len(cases)} cases, {refused} differences that are not allowed")
    return refused


def _listed(name: str, found: Iterator[Difference], used: Counter[Allowed]) -> int:
    """Print the differences that are not allowed, and count the others; how many were printed."""
    refused = 0
    for what, reasons in found:
        used.update(reasons)
        if not reasons:
            refused += 1
            print(f"{name}: {what}")
    return refused


def _files(roots: Iterable[Path], parts: Iterable[str]) -> list[str]:
    """Names, seen from the roots, of all files that are, or lie in, one of the parts of any of them."""
    paths = [(root, path) for root in roots for part in parts for path in (root / part, *(root / part).rglob("*"))]
    return sorted({str(path.relative_to(root)) for root, path in paths if path.is_file()})


def _commits(root: Path, cases: Iterable[str]) -> str:
    """Commits of the code that ran, by the runs' own record: comparing a version with itself proves nothing."""
    runs = [path for case in cases for path in (root / case).rglob("run.json")]
    found = {json.loads(path.read_text(encoding="utf-8"))["versions"]["git"] for path in runs}
    return ", ".join(sorted(found - {"unknown"})) or "unknown"


def main() -> int:
    """Do what the command line says; its exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    commands = parser.add_subparsers(dest="action", required=True)
    maker = commands.add_parser("make", help="run the cases by one version")
    maker.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of results")
    maker.add_argument("--command", required=True, metavar="WORDS", help="what starts the program")
    maker.add_argument("--cwd", type=Path, metavar="DIR", help="checkout whose code the command is to find")
    comparer = commands.add_parser("compare", help="list what differs between two folders of results")
    comparer.add_argument("a", type=Path, metavar="A")
    comparer.add_argument("b", type=Path, metavar="B")
    for one in (maker, comparer):
        one.add_argument("--only", type=lambda text: text.split(","), default=[], metavar="NAME,…", help="these cases")
    given = parser.parse_args()
    if given.action == "make":
        make(Version(command=shlex.split(given.command), checkout=given.cwd), given.out.resolve(), given.only)
        return 0
    for folder, name in itertools.product((given.a, given.b), read_cases(given.only)):
        if not (folder / name).is_dir():
            parser.error(f"{folder}: holds no case {name}; make it, or name others by --only")
    return 1 if compare(given.a, given.b, given.only) else 0


if __name__ == "__main__":
    sys.exit(main())
