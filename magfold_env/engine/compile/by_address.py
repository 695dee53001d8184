# Numba's own modules know no types.
# pyright: basic

"""Compiled kernels that other kernels call through their address, and a counter that threads share.

A kernel that calls another contains it. The integrator takes most of the time that the engine needs
to compile, so that what runs many chains calls it where it lies: it is compiled once, and one chain
and many run the same machine code.

A call by name from Python, on the other hand, first finds out the types of all that its arguments
hold, which takes 40 µs for a chain. Addresses are integers.
"""

from __future__ import annotations

from typing import Any, cast

import numba
from llvmlite import ir
from numba import extending
from numba.core import config, types

# With the types that kernels see, not those of what generates their code.
intrinsic = cast("Any", extending.intrinsic)

ADDRESS = ir.IntType(8).as_pointer()


def code_of(kernel: Any, *arguments: Any) -> int:
    """Return the address of a kernel's code for arguments of these types; compiles it if need be.

    It stays valid as long as the process lives.

    Raises
    ------
    RuntimeError
        If nothing is compiled, for a debugger's sake.
    """
    if cast("Any", config).DISABLE_JIT:
        raise RuntimeError(
            "NUMBA_DISABLE_JIT: many chains at once need compiled kernels; unset it, or step "
            "environments one by one (vectorization_mode='sync')"
        )
    signature = tuple(numba.typeof(each) for each in arguments)
    kernel.compile(signature)
    compiled = kernel.overloads[signature]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def _call(result: types.Type, places: tuple[types.Type, ...], number: types.Type) -> Any:
    """How to call code that takes NamedTuples by pointer, then a number."""
    signature = result(types.int64, *places, number)

    def generate(context: Any, builder: ir.IRBuilder, _signature: Any, args: Any) -> Any:
        pointers = [types.voidptr] * len(places)
        convention = context.call_conv
        function = convention.get_function_type(result, (*pointers, number))
        code = builder.inttoptr(args[0], function.as_pointer())
        passed = [builder.inttoptr(each, ADDRESS) for each in args[1:-1]]
        _, found = convention.call_function(
            builder, code, result, (*pointers, number), [*passed, args[-1]]
        )
        return found

    return signature, generate


@intrinsic
def call_int(
    _typing: Any, code: Any, model: Any, state: Any, work: Any, record: Any, x: Any
) -> Any:
    """Call code ``(Model, State, Work, Record, float) -> int`` by its address and theirs."""
    return _call(types.int64, (types.int64,) * 4, types.float64)


@intrinsic
def call_float(_typing: Any, code: Any, model: Any, state: Any, work: Any, x: Any) -> Any:
    """Call code ``(Model, State, Work, float) -> float`` by its address and theirs."""
    return _call(types.float64, (types.int64,) * 3, types.float64)


@intrinsic
def take(_typing: Any, counter: Any) -> Any:
    """Return the entry of a counter, an array of one integer, and add one to it in one go."""

    def generate(context: Any, builder: ir.IRBuilder, _signature: Any, args: Any) -> Any:
        array = context.make_array(counter)(context, builder, args[0])
        return builder.atomic_rmw("add", array.data, ir.IntType(64)(1), "monotonic")

    return types.int64(counter), generate
