"""Compiled code: only what a scene calls for, the same bits cold and warm, and no cache is a reason to fail."""

import os
import subprocess
import sys
from pathlib import Path

import builds
from numba import types

from dem.engine.links.compiler import callable_from_python
from dem.engine.links.stepping import advance

HERE = Path(__file__).parent
PROGRAM = """
import builds, hashlib, logging
logging.basicConfig(format="%(message)s")
made = builds.pile(builds.engine(gravity=9.81, radius=0.0234), 6, settle=0.02)
bodies = made._world.bodies
print(hashlib.sha256(bodies.position.tobytes() + bodies.turn.tobytes()).hexdigest())
"""


def run(cache: Path, program: str = PROGRAM) -> tuple[str, str]:
    """What a fresh process computes with a cache folder, and what it says."""
    path = os.pathsep.join([str(HERE), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "SMARTICLES_CACHE_DIR": str(cache), "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip(), done.stderr


def test_a_scene_compiles_what_it_calls_for_only() -> None:
    before = set(advance.signatures)
    made = builds.engine(gravity=9.81)
    made.add(builds.at([0, 0, 1.0]))
    made.advance(1)
    welded = [s for s in advance.signatures if s not in before] or list(before)
    plain = []
    for signature in welded:
        system = dict(zip(signature[2].fields, signature[2].types, strict=True))
        boundaries = dict(zip(system["boundaries"].fields, system["boundaries"].types, strict=True))
        lacking = [system[name] for name in ("motors", "cords", "ledger")]
        lacking += [boundaries[name] for name in ("channel", "hooks", "rims")]
        plain += [signature] if all(one is types.none for one in lacking) else []
    assert plain
    # Nothing of a hook, a rim, a string or the ledger is in its code. Compiled anew: cached code cannot be looked at.
    fresh = callable_from_python(advance.py_func)
    fresh.compile(plain[0])
    code = fresh.inspect_llvm(plain[0])
    for name in ("contacts_with_hooks", "nearest_to_circle", "settle", "middle_of_step"):
        assert name not in code, name
    assert "push_apart" in code


def test_cold_and_warm_give_the_same_bits_and_a_broken_cache_is_no_harm(tmp_path: Path) -> None:
    cold, said = run(tmp_path)
    assert "compiling the links engine" in said
    warm, said = run(tmp_path)
    assert warm == cold
    assert said == ""
    # One file of many: each is read by itself, and the largest would be compiled for long once more.
    small, *others = sorted(tmp_path.rglob("*.code"), key=lambda file: file.stat().st_size)
    assert others
    small.write_bytes(b"rubbish")
    broken, said = run(tmp_path)
    assert broken == cold
    assert "compiled code cannot be read" in said
    assert str(tmp_path) in said
    assert run(tmp_path) == (cold, "")  # what was broken has been compiled and stored


def test_a_folder_that_cannot_be_written_is_told_once(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    program = "import logging, builds; logging.basicConfig(format='%(message)s')\n"
    program += "made = builds.engine(); made.add(builds.at([0, 0, 1.0])); made.state(); print(made.count)"
    printed, said = run(blocked, program)
    assert printed == "1"
    assert said.count("compiled code cannot be kept") == 1
    assert "SMARTICLES_CACHE_DIR" in said


def test_a_function_is_linked_that_its_first_caller_never_reaches(tmp_path: Path) -> None:
    # LLVM removes the loop of `never`, so that `never` names `smaller` as its part but does not call it.
    program = """
from dem.engine.links.compiler import callable_from_python, part
smaller = part(lambda a, b: min(a, b) + 1.0)
@part
def often(a, b):
    return 2.0 * smaller(a, b)
@part
def never(a, b):
    total = a - b
    for _ in range(0):
        total += smaller(b, a)
    return total
@callable_from_python
def one(a, b):
    return often(a, b) + never(a, b)
@callable_from_python
def other(a, b):
    return never(a, b) + often(a, b)
print(one(1.0, 2.0), other(1.0, 2.0))
"""
    assert run(tmp_path, program)[0] == "3.0 3.0"
