"""The compiler of the law: numba, told what the marks of :mod:`trainmj.collision.jitable` mean.

Nothing else imports numba, and this module is imported only where a law is not on disk.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

from llvmlite import binding as llvm
from llvmlite import ir
from numba import types
from numba.core import cgutils, config, sigutils
from numba.core.ccallback import CFunc
from numba.core.targetconfig import ConfigStack
from numba.extending import lower_builtin, register_jitable, type_callable

from trainmj.collision.jitable import NOTED, from_place, integer_at, place_at, stored_at

_OPTIONS = {"no_cfunc_wrapper": True}  # what calls them is compiled, too
_FLOATS = types.CPointer(types.float64)


def tell() -> None:
    """Tell numba of all functions that were noted since the last time."""
    while NOTED:
        function, inlined, apart = NOTED.pop(0)
        if apart:
            _keep_apart(function)
        else:
            register_jitable(forceinline=inlined, **_OPTIONS)(function)


def compiled(function: Callable[..., Any], signature: str) -> Any:
    """Compile a C function. A division by zero in it is no exception: nobody would see one.

    Args:
        function: what numba can compile.
        signature: its types, in the words of numba.

    Returns:
        What numba makes of it, which must outlive all use of its ``address``.
    """
    tell()
    found: Any = CFunc(function, sigutils.normalize_signature(signature), {}, {"error_model": "numpy"})
    settings: Any = config
    disabled, settings.DISABLE_JIT = settings.DISABLE_JIT, 0  # which is for functions of the user's
    try:
        found.compile()
    finally:
        settings.DISABLE_JIT = disabled
    return found


def machine_code(function: Any, name: str, machine: llvm.TargetMachine) -> bytes:
    """An object file with a compiled function under a name of its own.

    The module is optimised once more with that one entry: what could never raise then no longer asks whether it did,
    and nothing of Python or numba is needed, only what every process has from the C library.
    """
    module = llvm.parse_assembly(function.inspect_llvm())
    for value in (*module.functions, *module.global_variables):
        if value.name == function.native_name:
            value.name = name
        elif not value.is_declaration:
            value.linkage = "internal"
    passes = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes.getModulePassManager().run(module, passes)
    return bytes(machine.emit_object(module))


def _in_place_of(function: Callable[..., Any], typed: Callable[..., Any]) -> Callable[[Any], Any]:
    """Decorate what makes the code that is called in place of a function, with types that follow from those given."""

    def decorate(lower: Any) -> Any:
        type_callable(function)(lambda context: wraps(function)(lambda *given: typed(*given)))  # by the same names
        lower_builtin(function, types.VarArg(types.Any))(lower)
        return lower

    return decorate


def _keep_apart(function: Callable[..., Any]) -> None:
    """Compile a function by itself, and call it so that LLVM does not make it a part of its caller."""

    def settled(given: Any) -> Any:
        number = types.int64 if isinstance(given, types.Integer) else types.float64
        return number if isinstance(given, types.Number) else given

    @_in_place_of(function, lambda *given: types.float64(*map(settled, given)))
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        # compiled like its caller, which numba does not do by itself: a division by zero is no exception there either
        flags = ConfigStack.top_or_none().copy()
        flags.forceinline = False
        compiled = context.compile_subroutine(builder, function, signature, flags=flags)
        found = context.call_internal(builder, compiled.fndesc, signature, args)
        for block in builder.function.blocks:
            for made in block.instructions:
                if isinstance(made, ir.CallInstr) and made.callee.name == compiled.fndesc.llvm_func_name:
                    made.attributes.add("noinline")
        return found


def _pointed(context: Any, builder: Any, args: Any, kind: Any) -> Any:
    """Pointer to a kind of value at base + offset."""
    return cgutils.pointer_add(builder, args[0], args[1], context.get_value_type(kind).as_pointer())


@_in_place_of(stored_at, lambda base, offset: _FLOATS(types.voidptr, types.int64))
def _stored_at(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return builder.load(_pointed(context, builder, args, _FLOATS))


@_in_place_of(place_at, lambda base, offset: _FLOATS(types.voidptr, types.int64))
def _place_at(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return _pointed(context, builder, args, types.float64)


@_in_place_of(integer_at, lambda base, offset: types.int64(types.voidptr, types.int64))
def _integer_at(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return builder.load(_pointed(context, builder, args, types.int64))


@_in_place_of(from_place, lambda values, place: _FLOATS(_FLOATS, types.int64))
def _from_place(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    return builder.gep(args[0], [args[1]])
