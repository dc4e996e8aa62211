"""Compiled code between processes: one compiles while others wait, and damaged code is never executed."""

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import pytest

from dem.engine.effect import EffectName
from dem.engine.links import cache, world
from dem.engine.links.compiler import kernel
from dem.engine.links.cost import COMPILE_FIRST, COMPILE_MORE
from dem.engine.links.kind import OPTIONAL, _present
from dem.engine.links.stepping import advance
from dem.plan.outlook import plan
from dem.run import warm
from dem.scene.reading import load_scene
from smarticles.commands import doctor
from smarticles.starters import path_of

# A small kernel, whose compilation is announced and takes until a file is there.
PROGRAM = """
import logging, sys, time
from pathlib import Path
logging.basicConfig(format="%(message)s")
from dem.engine.links import cache
from dem.engine.links.compiler import kernel
cache.PATIENCE = float(sys.argv[2])

@kernel
def tiny(x):
    return 2.0 * x + 1.0

compile_now = tiny._compiler.compile

def slowly(*arguments):
    print("compiles", flush=True)
    while not Path(sys.argv[1]).exists():
        time.sleep(0.05)
    return compile_now(*arguments)

tiny._compiler.compile = slowly
print(tiny(3.0), flush=True)
"""
HERE = Path(__file__)
WAITS = "another process compiles the links engine; waiting"
MINUTE = 60.0


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    return tmp_path


@contextmanager
def started(folder: Path, *, until: Path = HERE, patience: float = MINUTE) -> Iterator[subprocess.Popen[str]]:
    """A process that calls the kernel, whose compilation ends when a file is there; it is killed at the end."""
    child = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(until), str(patience)],
        env={**os.environ, cache.FOLDER: str(folder), "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with child:
        try:
            yield child
        finally:
            child.kill()


def compiling(child: subprocess.Popen[str]) -> None:
    """Wait until a process has begun to compile."""
    assert child.stdout is not None
    assert child.stdout.readline() == "compiles\n"


def waiting(child: subprocess.Popen[str]) -> None:
    """Wait until a process says that it waits for another one."""
    assert child.stderr is not None
    assert child.stderr.readline().startswith(WAITS)


def test_one_process_compiles_while_others_wait(tmp_path: Path) -> None:
    ready = tmp_path / "ready"
    with started(tmp_path, until=ready) as killed:
        compiling(killed)
    # It died while it compiled, and holds nobody up.
    with started(tmp_path, until=ready) as first:
        compiling(first)
        with started(tmp_path) as second, started(tmp_path) as third:
            waiting(second)
            waiting(third)
            ready.touch()
            assert first.communicate(timeout=MINUTE) == ("7.0\n", "")
            for other in (second, third):
                # Nothing was compiled, and one line was said, which has been read.
                assert other.communicate(timeout=MINUTE) == ("7.0\n", "")


def test_a_process_that_has_waited_too_long_compiles_by_itself(tmp_path: Path) -> None:
    with started(tmp_path, until=tmp_path / "never") as stuck:
        compiling(stuck)
        stuck.send_signal(signal.SIGSTOP)
        with started(tmp_path, patience=0.2) as other:
            out, said = other.communicate(timeout=MINUTE)
        assert out == "compiles\n7.0\n"
        assert "compiling here as well" in said


# -- kinds of phases ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "example", "changes"), doctor._COMPILED)
def test_the_kinds_of_code_that_a_scene_needs_are_known(
    kind: str, example: str, changes: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    called, stored = set(), cache.KernelCache(advance.py_func)

    def store(steps: int, *others: object) -> int:
        """Name and store code as for the kernel."""
        path = stored.path([numba.typeof(each) for each in (steps, *others)])
        assert path is not None
        path.touch()
        called.add(frozenset(cache._lacking(numba.typeof(others[1]), "system")))
        return steps

    # Neither this kernel nor queries are compiled, which would take long.
    monkeypatch.setattr(world, "advance", store)
    monkeypatch.setattr(warm, "_step_and_query", lambda engine: engine.advance(1))
    scene = load_scene(path_of(example), changes)
    needed = [OPTIONAL - present for present in _present(scene)]
    lifted = [needed[0] - {"rims"}] if "lifted" in kind else []

    # What the cache holds decides what is planned.
    cold = plan(scene)
    seconds = COMPILE_FIRST + COMPILE_MORE * (len(needed) - 1 + scene.calls_for(EffectName.WALL_REMOVAL))
    assert cold.compile_s == seconds
    assert f"compiling, once {seconds:.0f} s" in " ".join(cold.to_text().split())
    warm.compile_for(scene)
    assert called == {*needed, *lifted}
    assert plan(scene).compile_s == 0.0
    assert plan(scene).wall_s == cold.wall_s
    assert "compiling" not in plan(scene).to_text()


# -- in this process ---------------------------------------------------------------------------------------------------


def tiny(x: float) -> float:
    return 2.0 * x + 1.0


def other(x: float) -> float:
    return -x


def call(function: Callable[[float], float]) -> tuple[float, int]:
    """What a kernel returns for 3, made anew, and how often it was read from its file."""
    made: Any = kernel(function)
    return made(3.0), sum(made.stats.cache_hits.values())


def flipped(content: bytes, place: int) -> bytes:
    changed = bytearray(content)
    changed[place] ^= 1
    return bytes(changed)


def test_damaged_code_is_compiled_anew_and_never_executed(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert call(tiny) == (7.0, 0)
    assert call(tiny) == (7.0, 1)
    assert call(other) == (-3.0, 0)
    (file,), (foreign,) = folder.glob("tiny.*.code"), folder.glob("other.*.code")
    sound, size = file.read_bytes(), file.stat().st_size
    damaged = [b"", sound[:10], sound[: size // 2], sound[:-1], sound + b"\0", bytes(size), foreign.read_bytes()]
    damaged += [flipped(sound, place) for place in range(0, size, size // 12)]
    for content in damaged:
        file.write_bytes(content)
        caplog.clear()
        assert call(tiny) == (7.0, 0)
        assert "its checksum is wrong" in caplog.text
        assert str(file) in caplog.text
        assert call(tiny) == (7.0, 1)  # it was stored anew


def test_without_locks_every_process_compiles(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(cache.fcntl, "flock", no_locks)
    assert call(tiny) == (7.0, 0)
    monkeypatch.setattr(cache, "fcntl", None)
    next(folder.glob("tiny.*.code")).unlink()
    assert call(tiny) == (7.0, 0)
    assert call(tiny) == (7.0, 1)


def test_a_full_disk_is_no_harm(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert call(tiny) == (7.0, 0)
    assert "cannot be written" in caplog.text
    assert not list(folder.glob("*.code"))
