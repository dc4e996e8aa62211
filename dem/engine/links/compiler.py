# mypy: allow-untyped-calls
"""Compile kernels.

Numba optimises and translates each function separately, then links it into the functions that call it, and optimises
those again, level by level. Here all functions that a kernel calls are linked into the kernel, which is optimised once.
"""

import gc
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba import _dynfunc, types  # type: ignore[attr-defined] # an extension in C
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering

from dem.engine.links.cache import KernelCache

F = TypeVar("F", bound=Callable[..., Any])

# Without reordered arithmetic: with `fastmath`, a process that compiles and one that loads compiled code differ in
# their last bits. A division by zero gives inf, as in NumPy, and costs no branch. Without reference counts nothing can
# be allocated in a kernel, and passing arrays around costs nothing.
OPTIONS: dict[str, Any] = {"fastmath": False, "error_model": "numpy", "_nrt": False}
# Wrappers that C and Python need to call a function take long to compile; C calls no function, Python only kernels.
NOT_FROM_C: dict[str, Any] = {"no_cfunc_wrapper": True}
NOT_FROM_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True, **NOT_FROM_C}


class _PartLibrary(JITCodeLibrary):
    """Code of a function that only kernels call: neither linked nor translated to machine code."""

    def finalize(self) -> None:
        self._raise_if_finalized()
        self._finalized = True


class _KernelLibrary(JITCodeLibrary):
    """Code of a kernel and of all functions that it calls directly or indirectly."""

    def finalize(self) -> None:
        # LLVM leaves out what nothing calls that was linked before, so that callers come before what they call.
        order: dict[Any, None] = {}

        def add_after_callees(library: Any) -> None:
            if library not in order:
                if isinstance(library, _PartLibrary):
                    for called in library._linking_libraries:
                        add_after_callees(called)
                order[library] = None

        for library in self._linking_libraries:
            add_after_callees(library)
        self._linking_libraries = list(reversed(order))
        super().finalize()

    def _optimize_final_module(self) -> None:
        # Numba optimises twice, to remove reference counts in between; kernels have none.
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    _name = "links_part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags = Flags(state.flags)
        state.flags.no_compile = True
        super().run_pass(state)
        # Numba's key of compiled code is a function that Python can call; this one has no code.
        made = state.cr
        entry = _dynfunc.make_function(made.fndesc.lookup_module(), made.fndesc.qualname, "", 0, made.env, ())
        state.cr = made._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, made.fndesc, [state.library])
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):
    _name = "links_kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class _PartCompiler(Compiler):
    lowering: type = _PartLowering

    def define_pipelines(self) -> list[PassManager]:
        usual = super().define_pipelines()[0].passes
        passes = PassManager("links")
        passes.passes = [(self.lowering if one is NativeLowering else one, what) for one, what in usual]
        passes.finalize()
        return [passes]


class _KernelCompiler(_PartCompiler):
    lowering = _KernelLowering


def part(function: F, **options: Any) -> F:
    """Mark a function that only kernels call, for compilation; a call from Python crashes the process."""
    compiled = numba.njit(**OPTIONS, **NOT_FROM_PYTHON, **options, pipeline_class=_PartCompiler)(function)
    template = compiled.get_call_template

    def for_types(arguments: Any, keywords: Any) -> Any:
        # Numba would compile the function again for each integer constant.
        return template(tuple(types.unliteral(one) for one in arguments), keywords)

    compiled.get_call_template = for_types
    return compiled  # type: ignore[no-any-return]


def inlined(function: F) -> F:
    """Compile a small function into the functions that call it.

    An array counts as about ten arguments of a call, and `Bodies` alone has twelve arrays, so that a call would cost
    more than most small functions.
    """
    return part(function, forceinline=True)


def callable_from_python(function: Callable[..., Any]) -> Any:
    """Compile a function, with all that it calls, at its first call from Python; the code is not stored."""
    return numba.njit(**OPTIONS, **NOT_FROM_C, pipeline_class=_KernelCompiler)(function)


def kernel(function: F) -> F:
    """Compile a function at its first call from Python, and keep the code for later processes."""
    compiled = callable_from_python(function)
    compiled._cache, compile_now = KernelCache(function), compiled.compile

    def compile_in_turn(types_: Any) -> Any:
        with compiled._cache.turn(types_):
            # Most objects that Numba makes stay; searching them for garbage takes a tenth of the time.
            collected = gc.isenabled()
            gc.disable()
            try:
                return compile_now(types_)
            finally:
                if collected:
                    gc.enable()

    compiled.compile = compile_in_turn
    return compiled  # type: ignore[no-any-return]
