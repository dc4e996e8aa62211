"""Try random scenes and command lines: `python -m validation.fuzz --scenes 100000 --lines 20000 --out DIR`.

Scenes are shipped ones, of all shapes, with values put anywhere, keys dropped, added, nested and taken from other
scenes; some are files that are cut anywhere. Command lines have real files and options with good and bad values, but
no run, server or other process is started. A scene must be planned, or rejected in one line; a line must end with a
known status and at most one line of error; either within `MOST_S` of processor time and `MOST_BYTES` of memory.
Warnings of Python count as failures. Failures are counted by the place of their origin, and an example of each is
written to the directory --out.
"""

import argparse
import io
import json
import math
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, chdir, contextmanager, redirect_stderr, redirect_stdout
from copy import deepcopy
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import yaml

from dem.errors import InputError
from dem.plan.outlook import plan
from dem.scene.reading import dump_scene, json_schema, parse_scene
from dem.yaml_text import load_yaml
from smarticles.commands.run import read_scene
from smarticles.main import build_parser, main
from smarticles.starters import KINDS, starter
from studies.registry import STUDIES
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

ROOT = Path(__file__).resolve().parents[1]
MOST_S = 2.0  # processor time of one scene or command line
MOST_BYTES = 2**30  # memory that it may add
MOST_CHARACTERS = 1500  # of an error; three errors with long lists of choices have 1000
NAME = "scene.yaml"

NUMBERS: list[Any] = [
    *(0, -0.0, 1, -1, 2, 0.5, 5e-324, 1e-300, 1e-30, 1e-9, 1e9, 1e30, 1e300, 1.7e308, -1e300, 10**30, 10**400),
    *(math.nan, math.inf, -math.inf, 2**31, 2**53 + 1, 2**63, 2**64, 400, 100_000, 359.0, 180, 90, 1e-3, 1e-6),
]
TEXTS = [
    *("", " ", "0.4", "1 s", "1e3", "0,5", "true", "null", "yade", "links", "deposit", "draft", "\n", "a\nb", "\x00"),
    *("{{ 7 * 7 }}", "$(reboot)", "'; ls #", "../x", "<script>", "%s%n", "☃" * 200, "\ud800", "\u2028", "\x85"),
    *("\u202e", "x" * 2000, "rod", "chain", "filament", "motor", "elastic", "all", "servo", "*a", "&a", "[", "{", "- "),
]


class LateError(BaseException):
    """Raised in a call that takes too long; no Exception, so that no handler takes it for a known error."""


# -- scenes ------------------------------------------------------------------------------------------------------------


def shipped_scenes() -> list[dict[str, Any]]:
    """Return the scenes of all shipped sweeps and starters, every default written out, and those of the pages."""
    sweeps = [study.sweep_file(quick=study.quick) for study in STUDIES.values()]
    scenes = [point.scene for sweep in sweeps for point in expand(load_sweep(sweep))[::9]]
    scenes += [parse_scene(load_yaml(starter(kind)), source=kind) for kind in KINDS]
    pages = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "how-to").glob("*.md"))]
    blocks = [load_yaml(text) for page in pages for text in re.findall(r"```yaml\n(# \S+: .*?)```", page, re.DOTALL)]
    return [
        *(yaml.safe_load(dump_scene(scene)) for scene in scenes),
        # Scenes that begin with another run or a file of poses need it.
        *(block for block in blocks if "phases" in block and block["phases"][0]["type"] not in ("place", "take-over")),
    ]


def places(data: Any, here: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the keys that lead to each value below `data`."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield (*here, key)
        yield from places(value, (*here, key))


def value_at(data: Any, place: Sequence[Any]) -> Any:
    """Return the value to which the keys `place` lead."""
    for step in place:
        data = data[step]
    return data


def scaled(value: float, factor: float) -> float:
    """Return a number times a factor, of the number's type where it can hold the product."""
    try:
        product = value * float(factor)
    except OverflowError:  # whole numbers of Python have any length
        return value
    return type(value)(product) if math.isfinite(product) else product


class Scenes:
    """Draws random scenes from the shipped ones."""

    def __init__(self) -> None:
        schema = json_schema()
        self.keys = sorted({key for part in [schema, *schema["$defs"].values()] for key in part.get("properties", {})})
        self.shipped = shipped_scenes()
        kinds: dict[str, list[dict[str, Any]]] = {}
        for scene in self.shipped:
            kinds.setdefault(json.dumps(self._shapes(scene)), []).append(scene)
        self.kinds = list(kinds.values())
        self.texts = [str(yaml.safe_dump(scene, allow_unicode=True, sort_keys=False)) for scene in self.shipped]

    @staticmethod
    def _shapes(scene: dict[str, Any]) -> list[str]:
        particle = scene.get("particle") or {"shape": "plane" if scene.get("plane") else "smarticle"}
        return [part["shape"] for part in (particle if isinstance(particle, list) else [particle])]

    def value(self, rng: random.Random, depth: int = 0) -> Any:
        """Return any value: number, text, or a list or mapping of such."""
        kind = rng.random()
        if depth < 2 and kind < 0.15:
            parts = [self.value(rng, depth + 1) for _ in range(rng.randrange(4))]
            if rng.random() < 0.5:
                return parts
            return {rng.choice([*self.keys, *TEXTS]): part for part in parts}
        if kind < 0.6:
            power = rng.choice([rng.uniform(-4, 4), rng.uniform(-320, 308)])
            return rng.choice([rng.choice(NUMBERS), rng.choice([-1, 1, 1, 1]) * 10.0**power, rng.randrange(-3, 400)])
        return rng.choice([None, True, False, *TEXTS]) if kind < 0.95 else rng.choice(self.keys)

    def draw(self, rng: random.Random) -> Any:
        """Return a scene with one to three changes."""
        data = deepcopy(rng.choice(rng.choice(self.kinds)))
        for _ in range(rng.choice([1, 1, 1, 2, 3])):
            found = list(places(data))
            if not found:
                return data
            *above, last = rng.choice(found)
            parent = value_at(data, above)
            value = parent[last]
            what = rng.choice(["put", "scale", "near", "near", "drop", "add", "nest", "twice", "of"])
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if what == "drop":
                del parent[last]
            elif what == "near" and number:
                parent[last] = scaled(value, rng.choice([-1, 0.1, 0.5, 0.8, 0.999, 1.001, 1.3, 2, 3, 10, 100]))
            elif what == "scale" and number:
                parent[last] = scaled(value, 10.0 ** rng.randrange(-320, 309))
            elif what == "add" and isinstance(parent, dict):
                parent[rng.choice([*self.keys, *TEXTS])] = self.value(rng)
            elif what == "nest":
                parent[last] = rng.choice([[value], {last: value}, [value, value], {"type": value}])
            elif what == "twice" and isinstance(parent, list):
                parent.append(deepcopy(value))
            elif what == "of":
                other = rng.choice(rng.choice(self.kinds))
                likes = [place for place in places(other) if place[-1] == last] or list(places(other))
                parent[last] = deepcopy(value_at(other, rng.choice(likes)))
            else:
                parent[last] = self.value(rng)
        return data

    def cut(self, rng: random.Random) -> str:
        """Return the text of a scene with something cut out, and something put in."""
        text, at, length = rng.choice(self.texts), rng.randrange(3000), rng.choice([0, 1, 9, 200])
        inserted = rng.choice([*TEXTS, f"{rng.choice(NUMBERS[:16])}", rng.choice(self.keys), "\t", "#", ": ", "\n  "])
        return f"{text[:at]}{inserted.encode('utf-8', 'replace').decode()}{text[at + length :]}"


def check_scene(scene: Any, folder: Path) -> str:
    """Plan a scene, of plain data or of a text; return "planned" or "rejected", or raise AssertionError."""
    source = NAME
    try:
        if isinstance(scene, str):
            file = folder / NAME
            file.write_text(scene, encoding="utf-8")
            source = str(file)
            planned = plan(read_scene(file, []))
        else:
            planned = plan(parse_scene(scene, source=NAME, folder=folder))
    except InputError as error:
        line = str(error)
        assert len(line.splitlines()) == 1, f"lines: {line}"
        assert not isinstance(scene, str) or line.startswith(source), f"no file named: {line}"
        assert len(line) <= MOST_CHARACTERS, f"too long: {line}"
        return "rejected"
    words = planned.to_text().replace(",", " ").split()
    json.dumps(asdict(planned), allow_nan=False)
    assert not {"nan", "inf"} & set(words), f"no number: {planned.to_text()}"
    return "planned"


# -- command lines -----------------------------------------------------------------------------------------------------

TEMPLATE = "schema_version: 1\nengine: links\nseed: {{ seed }}\ncount: {{ count }}\nphases: [{type: deposit}]\n"
SWEEP = """\
schema_version: 1
name: two counts
template: scene.yaml.j2
run_name: "n{{ count }}_{{ seed }}"
points: {grid: {count: [5, 6]}}
repeats: {seeds: [1]}
"""
FILES = {
    "scene.yaml": starter("shaken"),
    "snakes.yaml": starter("snakes"),
    "mixture.yaml": starter("mixture"),
    "scene.yaml.j2": TEMPLATE,
    "sweep.yaml": SWEEP,
    "table.csv": "run,x [m],phi\na,1,0.2\nb,2,nan\n",
    "empty.csv": "",
    "not.yaml": "phases: [",
    "bytes.yaml": "\x00\xff",
}
STATUSES = (0, 1, 2, 75, 130)
SLOW = ("report", "render", "study")  # commands that are drawn less often


def write_files(folder: Path, runs: Sequence[Path]) -> None:
    """Write the files that command lines name into a folder, with copies of run directories."""
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "empty").mkdir()
    for run in runs:
        shutil.copytree(run, folder / run.name)
    with chdir(folder), redirect_stdout(io.StringIO()):
        assert main(["sweep", "sweep.yaml", "--out", "sweep"]) == 0


class Lines:
    """Draws random command lines for the files in a folder."""

    def __init__(self, runs: Sequence[Path]) -> None:
        self.parsers = build_parser()[1].parsers
        self.paths = [*FILES, "empty", "sweep", "absent", "new", "sweep/runs/n5_1", *(run.name for run in runs)] + [
            f"{run.name}/{name}" for run in runs for name in ("series.h5", "run.json", "frames", "scene.yaml")
        ]
        self.outputs = [*(f"new.{suffix}" for suffix in "png gif csv html glb gsd vtp".split()), "new", "a/b/c.png"]
        self.words = [
            *(text for text in TEXTS if "\x00" not in text and "\ud800" not in text),
            *("1 0 -1 0.5 nan inf 1e400 1,2 1:2 run count=3 phases.1= =".split()),
            "9" * 5000,
            *("fidelity=draft", "particle={shape: rod, length_m: 0.01}", "phases.0.type=lift", "speed", "top", "01:00"),
            *("phases.9.x=1", "x.y.z=[", "seed=1e9", "linking", "crossing-number", "theta", "count", "last", "gravish"),
            *("--", "-", "-x", "--help", "--debug", "--=", "@x", "~", "*"),
        ]

    def draw(self, rng: random.Random) -> list[str]:
        """Return the words of a command line."""
        if rng.random() < 0.02:
            return [rng.choice([*self.words, *self.parsers]) for _ in range(rng.randrange(4))]
        command = rng.choice([name for name in self.parsers if name != "doctor"])
        if command in SLOW and rng.random() < 0.7:
            command = rng.choice([name for name in self.parsers if name not in (*SLOW, "doctor")])
        words = []
        for action in self.parsers[command]._actions:
            needed = action.required or not action.option_strings
            if isinstance(action, argparse._HelpAction) or rng.random() > (0.97 if needed else 0.12):
                continue
            if action.option_strings:
                words.append(rng.choice(action.option_strings))
            if action.nargs != 0:
                count = rng.choice([1, 1, 1, 2, 3]) if action.nargs in ("+", "*") else 1
                words += [self._value(rng, action) for _ in range(count)]
        if rng.random() < 0.1:
            words.insert(rng.randrange(len(words) + 1), rng.choice(self.words))
        return [command, *words]

    def _value(self, rng: random.Random, action: argparse.Action) -> str:
        if rng.random() < 0.1:
            return rng.choice(self.words)
        if action.choices and action.dest != "name":
            return str(rng.choice(list(action.choices)))
        if action.type is Path or action.dest in ("cluster",):
            new = action.dest in ("out", "output", "table") and rng.random() < 0.7
            return rng.choice(self.outputs if new else self.paths)
        if action.dest == "name":
            # Of the studies the smallest: before its first run, `study` expands whole sweeps.
            return rng.choice(["gravish", "gravish-x", "motor", "shake", *self.words])
        if action.dest == "size":
            return rng.choice(["64", "64x80", "0", "1x1", "100000", "99999999x1", "1"])
        return rng.choice([*self.words, "1", "2", "0.1", "0.01"])


def check_line(words: Sequence[str]) -> str:
    """Call `smarticles` with the given words; return its status, or raise AssertionError."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main(list(words))
    text = err.getvalue()
    lines = [line for line in text.splitlines() if "warning: " not in line]
    assert "internal error" not in text, text
    assert status in STATUSES, f"status {status}: {text}"
    if "--debug" not in words:
        assert "Traceback" not in text, text
        assert len(lines) <= 1, f"lines: {text}"
        assert not status or lines, f"status {status} without a word"
    return f"status {status}"


@contextmanager
def nothing_started() -> Iterator[None]:
    """Replace what starts runs, servers and processes, or waits."""

    class Absent(subprocess.Popen[bytes]):
        def __init__(self, *_: Any, **__: Any) -> None:
            raise FileNotFoundError(2, "No such file or directory", "program")

        def __del__(self, *_: Any) -> None:
            pass

    def stopped(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    with ExitStack() as stack:
        starters = "dem.run.run.run_scene templates.local.run_folder postprocess.view.view_run time.sleep"
        for target in starters.split():
            stack.enter_context(mock.patch(target, stopped))
        stack.enter_context(mock.patch.object(subprocess, "Popen", Absent))
        yield


# -- both --------------------------------------------------------------------------------------------------------------


@contextmanager
def limited(seconds: float, size: int) -> Iterator[None]:
    """Raise LateError after some processor time [s], and MemoryError after some more memory [B].

    Sweeps limit their own time by the other timer, ITIMER_VIRTUAL.
    """

    def late(*_: object) -> None:
        raise LateError(f"took more than {seconds:g} s of processor time")

    before, limits = signal.signal(signal.SIGPROF, late), resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + size, limits[1]))
    signal.setitimer(signal.ITIMER_PROF, seconds, seconds)  # again, should a handler swallow it
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        signal.signal(signal.SIGPROF, before)


@dataclass
class Tally:
    """Counts ends of calls and failures by origin, and writes an example of each failure."""

    out: Path
    ends: Counter[str] = field(default_factory=Counter)
    failures: Counter[str] = field(default_factory=Counter)
    slowest_s: float = 0.0
    begun: float = field(default_factory=time.monotonic)

    def call(self, what: Callable[[], str], example: str) -> None:
        """Call a check; `example` is the text that is written if it fails, or is the slowest so far."""
        began = time.process_time()
        try:
            with limited(MOST_S, MOST_BYTES):
                self.ends[what()] += 1
        except (Exception, LateError) as error:
            ours = [at for at in traceback.extract_tb(error.__traceback__) if str(ROOT) in at.filename]
            at = next((at for at in reversed(ours) if at.filename != __file__), ours[-1])
            place = f"{Path(at.filename).relative_to(ROOT)}:{at.lineno}"
            where = re.sub(r"[\d.]+|'.*?'|/\S+", "_", str(error))[:70] if isinstance(error, AssertionError) else place
            key = f"{type(error).__name__} {' '.join(where.split())}"
            self.failures[key] += 1
            if self.failures[key] == 1:
                name = f"{len(self.failures):03d}"
                (self.out / f"{name}.txt").write_text(example, encoding="utf-8", errors="replace")
                (self.out / f"{name}.error").write_text(traceback.format_exc(), encoding="utf-8", errors="replace")
                print(f"{name} {key}: {' '.join(str(error).split())[:300]}", flush=True)
        took = time.process_time() - began
        if took > self.slowest_s:
            self.slowest_s = took
            (self.out / "slowest.txt").write_text(f"{took:.2f} s\n{example}", encoding="utf-8", errors="replace")
        number = self.ends.total() + self.failures.total()
        if number % 5000 == 0:
            print(self, flush=True)

    def __str__(self) -> str:
        ends = ", ".join(f"{count} {end}" for end, count in sorted(self.ends.items()))
        wall, most = time.monotonic() - self.begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        return (
            f"{ends}, {self.failures.total()} failed ({len(self.failures)} kinds); slowest {self.slowest_s:.2f} s, "
            f"memory {most:.2f} GiB, {wall:.0f} s"
        )


def fuzz_scenes(count: int, seed: int, out: Path) -> Tally:
    """Check random scenes, every tenth of them as a text; return what became of them."""
    scenes, tally = Scenes(), Tally(out)
    for scene in scenes.shipped:  # also imports and compiles, which is not what one scene costs
        check_scene(scene, out)
    for number in range(count):
        rng = random.Random(f"scene {seed} {number}")
        drawn: Any = scenes.cut(rng) if number % 10 == 0 else scenes.draw(rng)
        tally.call(partial(check_scene, drawn, out), drawn if isinstance(drawn, str) else repr(drawn))
    return tally


def fuzz_lines(count: int, seed: int, out: Path, runs: Sequence[Path]) -> Tally:
    """Check random command lines on fresh files every hundred lines; return what became of them."""
    lines, tally, folder = Lines(runs), Tally(out), out / "files"
    for run in runs:  # imports and compiles, which is not what one line costs
        for command in (["measure"], ["render", "--size", "64"], ["report"], ["export", "--to", "glb"]):
            with tempfile.TemporaryDirectory() as scratch:
                shutil.copytree(run, copy := Path(scratch) / "run")
                check_line([command[0], str(copy), *command[1:]])
    for number in range(count):
        if number % 100 == 0:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            write_files(folder, runs)
        rng = random.Random(f"line {seed} {number}")
        words = lines.draw(rng)
        # Names what ends this process.
        (out / "last.txt").write_text(f"{number} {words!r}", encoding="utf-8", errors="replace")
        with chdir(folder), nothing_started():
            tally.call(partial(check_line, words), repr(words))
    return tally


def fuzz(arguments: Sequence[str] | None = None) -> int:
    """Run the program; return 1 if anything failed, else 0."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=0, metavar="N", help="number of random scenes")
    parser.add_argument("--lines", type=int, default=0, metavar="N", help="number of random command lines")
    parser.add_argument("--seed", type=int, default=1, help="of all draws; default: 1")
    parser.add_argument("--runs", type=Path, nargs="*", default=[], metavar="DIR", help="run directories for the lines")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory for examples of failures")
    given = parser.parse_args(arguments)
    warnings.simplefilter("error")
    failed = 0
    check_lines = partial(fuzz_lines, runs=[run.resolve() for run in given.runs])
    for what, count, check in (("scenes", given.scenes, fuzz_scenes), ("lines", given.lines, check_lines)):
        if count:
            out = given.out.resolve() / what
            out.mkdir(parents=True, exist_ok=True)
            tally = check(count, given.seed, out)
            print(f"{count} {what}: {tally}", *(f"{n} × {key}" for key, n in tally.failures.most_common()), sep="\n")
            failed += tally.failures.total()
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(fuzz())
