"""Where threads wait for each other inside a kernel: a fraction of a microsecond where each has a core.

A thread that waits looks again and again, as the others are done soon; after a while it sleeps in between, since it may
be its core that they need. To yield the core is not enough: where others want it as well, that was three times slower.
"""

from __future__ import annotations

import platform
import sys
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from dem.engine.links.compiler import intrinsic, part

Gate = NDArray[np.int64]

ARRIVED, TURN, OVER = 0, 16, 32  # places in a gate, each in a line of memory of its own
PLACES = 48
LOOKS, SLEEP = 4000, 50  # before a thread sleeps, about 60 us; and how long it sleeps [us]

X86, UNIX = platform.machine() in ("x86_64", "AMD64", "i386", "i686"), sys.platform != "win32"
_usleep: Any = types.ExternalFunction("usleep", types.intc(types.uintc)) if UNIX else None


def gate() -> Gate:
    """A new barrier."""
    return np.zeros(PLACES, np.int64)


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    return builder.gep(make_array(kind)(context, builder, array).data, [index])  # type: ignore[no-untyped-call]


@intrinsic
def _count(typing: Any, gate: Any, place: Any) -> Any:
    """Add one, and tell what was there before."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = _place(context, builder, signature.args[0], *arguments)
        return builder.atomic_rmw("add", pointer, ir.Constant(ir.IntType(64), 1), "seq_cst")

    return types.int64(gate, types.intp), generate


@intrinsic
def _read(typing: Any, gate: Any, place: Any) -> Any:
    """What is there; whatever the thread that wrote it had written before can be read from here on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(_place(context, builder, signature.args[0], *arguments), "seq_cst", 8)

    return types.int64(gate, types.intp), generate


@intrinsic
def _write(typing: Any, gate: Any, place: Any, value: Any) -> Any:
    """Write what others will `_read`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, place, value = arguments
        builder.store_atomic(value, _place(context, builder, signature.args[0], array, place), "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(gate, types.intp, types.int64), generate


@intrinsic
def _rest(typing: Any) -> Any:
    """Tell the processor that this thread waits, where it knows the word."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if X86:
            kind = ir.FunctionType(ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.sse2.pause"), [])  # type: ignore[no-untyped-call]
        return context.get_dummy_value()

    return types.void(), generate


@part
def wait(gate: Gate, threads: int) -> None:
    """Go on when all threads have come here, or when it is over.

    Args:
        gate: the barrier.
        threads: how many there are.
    """
    turn: int = _read(gate, TURN)
    if _count(gate, ARRIVED) == threads - 1:
        _write(gate, ARRIVED, 0)
        _write(gate, TURN, turn + 1)
        return
    looks = 0
    while _read(gate, TURN) == turn:
        looks += 1
        if looks < LOOKS:
            _rest()
        else:
            if UNIX:
                _usleep(np.uint32(SLEEP))
            if _read(gate, OVER) != 0:
                return


@part
def over(gate: Gate) -> bool:
    """Whether a thread has failed: nobody is to wait for it any longer."""
    return bool(_read(gate, OVER) != 0)
