"""Whether two versions of the program compute the same bits: small scenes, run by one and by the other, compared.

    python bits.py make --out before --command "python -m smarticles" --cwd OLD_CHECKOUT
    python bits.py make --out after --command "python -m smarticles" --cwd NEW_CHECKOUT
    python bits.py compare before after

`make` runs the cases of `bits_scenes.yaml` by the command line alone, so that it drives any version; `compare` lists
what differs in the files and in what was printed, and ends with status 1 if any of it is not in `ALLOWED`.
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
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import yaml

from dem.record.vtkhdf import read_step, read_times

CASES = Path(__file__).with_name("bits_scenes.yaml")
SAID = "said"  # folder of a case with what its commands printed
LIMIT_S = 900.0  # longest time of one command
TO_BE_CONTINUED = 75  # exit status of a run that SIGUSR1 stopped

# Differences that are none in what is computed: files (a name pattern, seen from the folder of results), text that is
# left out of their lines before they are compared, and the reason. Lines of data are `place: value`, see `lines_of`.
ALLOWED = (
    ("*.json", r"^.*\bversions\..*", "versions and commit of the code"),
    ("*/versions.json", r".*", "versions of the code"),
    ("*", r"(?<=Versions: ).*", "versions and commit of the code, how it was called"),
    ("*/provenance.json", r"^analysed_with\..*", "versions of the code"),
    ("*.json", r"^(\S*\.)?command: .*", "how it was called"),
    ("*.json", r"^(\S*\.)?started: .*", "date"),
    ("*/sweep.json", r"^created: .*", "date"),
    ("*/job.json", r"^stored: .*", "date"),
    ("*/done.json", r"^.*(wall|cpu)_s: .*", "wall and processor time"),
    ("*-status.json", r"^.*wall_s: .*", "wall time"),
    ("*/checkpoint*.zip", r".*", "not compared; twins show where it leads"),
    ("*/.lock", r".*", "process that ran"),
    ("*/log.txt", r"^[-\d]+ [:\d]+,\d+", "date"),
    ("*/log.txt", r"(?<= after )[\d.]+(?= s of wall time$)", "wall time"),
    ("*.txt", r"(?<= simulated in )[\d.]+(?= s$)", "wall time"),
    ("*.txt", r"(?<=(?:done|iled) after )[\d:]+", "wall time"),
    ("*.txt", r"^\d+ of \d+ runs ended.*", "printed twice a minute of wall time"),
    ("*-plan.*", r"(?<=table: )/\S*(?=/results/accuracy/)", "where the checkout lies"),
    ("*-plan.*", r"^(compile_s: |compiling, once|total ).*", "time to compile, until the code is stored"),
    ("*.txt", r"^(compiling|another process compiles) the links engine.*", "printed until the code is stored"),
    ("*/array.sh", r"(?<=[ (])/\S*(?=/)", "where the folder and the program lie"),
    ("*/array.sh", r"(?<=--job-name=).*", "contains a hash of where the folder lies"),
    ("*/job.json", r"^job_name: .*", "contains a hash of where the folder lies"),
    ("accuracy/ladder/results/*.csv", r"^(wall|processor) time .*", "wall and processor time"),
    ("accuracy/ladder/results/accuracy.*", r".*", "drawn and printed over processor time; tables are compared"),
    ("accuracy/said/02-accuracy.out.txt", r".*", "printed over processor time; tables are compared"),
)
PACKED = (".vtu", ".vtkhdf", ".h5")  # the same content may have other bytes
SAME_OF_TWINS = (
    "frames",
    "spheres",
    "frames.pvd",
    "frames.vtkhdf",
    "spheres.pvd",
    "series.h5",
    "scene.yaml",
    "done.json",
)


def read_cases(only: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The cases, all or those named, each with all of its files and commands."""
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


def make(command: Sequence[str], checkout: Path | None, out: Path, only: Sequence[str]) -> None:
    """Run the cases into folders of their own.

    Args:
        command: words that start the program.
        checkout: its code, first on Python's path; None: what the command finds by itself.
        out: folder of results.
        only: names of cases; empty: all.
    """
    cases = read_cases(only)
    for name in cases:
        if (out / name).exists():
            sys.exit(f"--out {out}: holds {name} already; remove it, or choose another folder")
    # One thread: bits depend on their number. The width of help texts is that of the terminal.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "COLUMNS": "100", "PYTHONDONTWRITEBYTECODE": "1"}
    if checkout is not None:
        paths = [str(checkout.resolve()), os.environ.get("PYTHONPATH", "")]
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    for name, case in cases.items():
        started = time.monotonic()
        hidden = {"GIT_DIR": os.devnull} if "hide_commit" in case else {}
        make_case(command, environment | hidden, out / name, case)
        print(f"{time.monotonic() - started:6.1f} s  {name}", flush=True)


def make_case(command: Sequence[str], environment: Mapping[str, str], folder: Path, case: Mapping[str, Any]) -> None:
    """Write the files of a case, run its commands, and keep what they print."""
    (folder / SAID).mkdir(parents=True)
    for file, text in case["files"].items():
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    for number, entry in enumerate(case["commands"], 1):
        stopped = isinstance(entry, Mapping)
        words = shlex.split(entry["stop"] if stopped else entry)
        # In the folder of the case, so that no path in what it writes contains where that is.
        process = subprocess.Popen(
            [*command, *words],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )
        if stopped:
            _stop(process, folder / words[words.index("--out") + 1] / "frames", entry["frames"])
        try:
            out, err = process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            process.terminate()  # it stops its own processes
            process.communicate()
            sys.exit(f"{folder}: not done after {LIMIT_S:g} s: {shlex.join(words)}")
        if stopped and process.returncode != TO_BE_CONTINUED:
            sys.exit(f"{folder}: ended before it was stopped, with status {process.returncode}: {err}")
        stem = folder / SAID / f"{number:02d}-{words[0].strip('-') if words else 'nothing'}"
        stem.with_suffix(".json" if "--json" in words else ".out.txt").write_text(out, encoding="utf-8")
        text = f"$ {shlex.join(words)}\nexit status {process.returncode}\n{err}"
        stem.with_suffix(".err.txt").write_text(text, encoding="utf-8")


def _stop(process: subprocess.Popen[str], frames: Path, number: int) -> None:
    """Ask a run to stop at its next checkpoint when it has written so many frames."""
    until = time.monotonic() + LIMIT_S
    while process.poll() is None and time.monotonic() < until:
        if frames.is_dir() and sum(1 for _ in frames.glob("frame_*.vtu")) >= number:
            process.send_signal(signal.SIGUSR1)
            return
        time.sleep(0.002)


def lines_of(path: Path) -> list[str]:
    """All that a file contains: lines of text, or one line `place: value` for each value, each row of an array."""
    if path.suffix in PACKED:
        return [line for name, values in _arrays(path).items() for line in _rows(name, values)]
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return [path.read_bytes().hex()]
    if path.suffix == ".json" and text.lstrip()[:1] in ("{", "["):
        return list(_leaves(json.loads(text), ""))
    lines = text.splitlines()
    if path.suffix == ".csv":
        header, *rows = csv.reader([line for line in lines if not line.startswith("#")])
        cells = [f"{name} [{k}]: {cell}" for k, row in enumerate(rows) for name, cell in zip(header, row, strict=True)]
        return [line for line in lines if line.startswith("#")] + cells
    return lines


def _arrays(path: Path) -> dict[str, Any]:
    """Arrays, and attributes, of a mesh or a file of series."""
    if path.suffix == ".vtu":
        mesh = meshio.read(path)
        arrays = {"points": mesh.points, **mesh.point_data}
        arrays |= {f"cells.{k}.{block.type}": block.data for k, block in enumerate(mesh.cells)}
        return arrays | {f"{name}.{k}": data for name, parts in mesh.cell_data.items() for k, data in enumerate(parts)}
    if path.suffix == ".vtkhdf":
        frames = [read_step(path, k) for k in range(len(read_times(path)))]
        return {
            f"{k}.{name}": rows
            for k, mesh in enumerate(frames)
            for name, rows in {"points": mesh.points, **{n: v[0] for n, v in mesh.cell_data.items()}}.items()
        }
    with h5py.File(path) as file:
        found = {f"{item.name}@{key}": value for item in (file, *file.values()) for key, value in item.attrs.items()}
        return found | {name: file[name][()] for name in file}


def _rows(name: str, values: Any) -> Iterator[str]:
    array = np.asarray(values)
    yield f"{name}: {array.dtype} {array.shape}"
    yield from (f"{name} [{k}]: {row!r}" for k, row in enumerate(np.atleast_1d(array).tolist()))


def _leaves(data: Any, place: str) -> Iterator[str]:
    if isinstance(data, dict | list) and data:
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from _leaves(value, f"{place}.{key}".lstrip("."))
    else:
        yield f"{place}: {json.dumps(data, ensure_ascii=False)}"


def differences(file: str, a: Path, b: Path, used: Counter[str]) -> Iterator[str]:
    """Yield lines that differ between two files, either of which may be absent; count allowed differences in `used`.

    Args:
        file: their name, for `ALLOWED`.
        a: the one.
        b: the other.
        used: reasons, with how often they applied.
    """
    if a.exists() != b.exists():
        yield "only in A" if a.exists() else "only in B"
        return
    if a.read_bytes() == b.read_bytes():
        return
    before = after = [lines_of(a), lines_of(b)]
    for pattern, text, reason in ALLOWED:
        if fnmatchcase(file, pattern):
            one, other = ([re.sub(text, "", line) for line in lines] for lines in after)
            used[f"{pattern}: {reason}"] += [one, other] != after and after[0] != after[1]
            after = [[line for line in lines if line] for lines in (one, other)]
    if before[0] == before[1] and a.suffix not in PACKED:
        yield "other bytes for the same content"
    changes = difflib.unified_diff(*after, n=0, lineterm="")
    yield from (line for line in changes if not line.startswith(("--- ", "+++ ", "@@ ")))


def compare(a: Path, b: Path, only: Sequence[str]) -> int:
    """List what differs between two folders of results, and between the twins in each.

    Returns:
        How many differences are not allowed.
    """
    cases, used = read_cases(only), Counter[str]()
    print(f"A: {a}, commit {_commits(a, cases)}\nB: {b}, commit {_commits(b, cases)}")
    names = _files([a, b], cases)
    pairs = [(name, name, a / name, b / name) for name in names]
    for root, (name, case) in itertools.product((a, b), cases.items()):
        if "twins" in case:
            one, other = (root / name / twin for twin in case["twins"])
            files = _files([one, other], SAME_OF_TWINS)
            pairs += [(f"{one} | {other.name}: {f}", f"{name}/{f}", one / f, other / f) for f in files]
    found = [f"{shown}: {line}" for shown, file, *paths in pairs for line in differences(file, *paths, used)]
    print("\n".join(found))
    print("\n".join(f"allowed in {count} files: {reason}" for reason, count in used.items() if count))
    print(f"{len(names)} files of {len(cases)} cases, {len(found)} differences that are not allowed")
    return len(found)


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
        make(shlex.split(given.command), given.cwd, given.out.resolve(), given.only)
        return 0
    for folder, name in itertools.product((given.a, given.b), read_cases(given.only)):
        if not (folder / name).is_dir():
            parser.error(f"{folder}: holds no case {name}; make it, or name others by --only")
    return 1 if compare(given.a, given.b, given.only) else 0


if __name__ == "__main__":
    sys.exit(main())
