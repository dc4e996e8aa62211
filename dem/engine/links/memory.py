"""A word to the processor about memory that will be needed soon. Nothing of what is computed depends on it."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array

from dem.engine.links.compiler import intrinsic

LINE = 64  # bytes that come together


@intrinsic
def fetch(typing: Any, array: Any, row: Any, lines: Any) -> Any:
    """Have the beginning of a row of an array brought near, while other work is done.

    Args:
        typing: Numba's.
        array: contiguous.
        row: along its first axis; must be there.
        lines: how much of it, a number that is written out.
    """
    if not isinstance(lines, types.IntegerLiteral):
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = signature.args[0]
        made = make_array(kind)(context, builder, arguments[0])  # type: ignore[no-untyped-call]
        number, byte = ir.IntType(32), ir.IntType(8).as_pointer()
        asked = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        prefetch = cgutils.get_or_insert_function(builder.module, asked, "llvm.prefetch.p0")  # type: ignore[no-untyped-call]
        stride = cgutils.unpack_tuple(builder, made.strides, kind.ndim)[0]  # type: ignore[no-untyped-call]
        start = builder.gep(builder.bitcast(made.data, byte), [builder.mul(stride, arguments[1])])
        for line in range(lines.literal_value):
            place = builder.gep(start, [ir.Constant(ir.IntType(64), LINE * line)])
            # To be read, to be kept, data.
            builder.call(prefetch, [place, *(ir.Constant(number, value) for value in (0, 3, 1))])
        return context.get_dummy_value()

    return types.void(array, types.intp, lines), generate
