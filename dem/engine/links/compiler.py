"""How kernels are compiled: cached where the user may write, never with reordered arithmetic."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile a function at its first call, and keep the code for later processes.

    `fastmath` stays off: with it, a process that compiles and one that loads compiled code differ in their last bits.
    `error_model="numpy"`: a division by zero gives inf, as in NumPy, and costs no branch.
    """
    return numba.njit(cache=True, fastmath=False, error_model="numpy")(function)  # type: ignore[no-any-return]


def inlined(function: F) -> F:
    """The same for small functions that are called in inner loops."""
    return numba.njit(cache=True, fastmath=False, error_model="numpy", inline="never")(function)  # type: ignore[no-any-return]
