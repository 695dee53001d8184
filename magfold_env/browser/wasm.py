# Numba's own modules have no type annotations.
# pyright: basic

"""Compile kernels to one WebAssembly module without imports, by means of compilers' internals.

Numba only translates kernels to LLVM's language (`engine.compile.numba_private`). This code is the
same on every machine; LLVM optimises it for WebAssembly, and LLD links the result. Addresses have
four bytes; in words of eight bytes, the other four are zero. WebAssembly has no instructions or
library functions for sines, fused multiply-adds and the like, so kernels of this package replace
them.
"""

import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, cast

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import types

from magfold_env.engine import elementary
from magfold_env.engine.compile import jit, numba_private
from magfold_env.files import pip_install

TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals,+simd128"
STACK = 256 * 1024  # bytes
LINKERS = ("wasm-ld", "wasm-ld-22", "wasm-ld-21", "wasm-ld-20", "wasm-ld-19")
NO_LINKER = f"needs a linker for WebAssembly: {pip_install('browser')}, or Debian's package lld"

_KINDS = {"int64": ("i64", "i32"), "float64": ("double", "double")}  # in kernels, and for callers
_POINTER = ("ptr", "ptr")
# The upper 64 bits of a product, for division by constants, computed from halves of 32 bits.
_MULTIPLY = """
define i128 @__multi3(i128 %a, i128 %b) noinline optnone {
  %a0 = trunc i128 %a to i64
  %as = lshr i128 %a, 64
  %a1 = trunc i128 %as to i64
  %b0 = trunc i128 %b to i64
  %bs = lshr i128 %b, 64
  %b1 = trunc i128 %bs to i64
  %al = and i64 %a0, 4294967295
  %ah = lshr i64 %a0, 32
  %bl = and i64 %b0, 4294967295
  %bh = lshr i64 %b0, 32
  %ll = mul i64 %al, %bl
  %lh = mul i64 %al, %bh
  %hl = mul i64 %ah, %bl
  %hh = mul i64 %ah, %bh
  %c0 = lshr i64 %ll, 32
  %c1 = and i64 %lh, 4294967295
  %c2 = and i64 %hl, 4294967295
  %s0 = add i64 %c0, %c1
  %s1 = add i64 %s0, %c2
  %low0 = and i64 %ll, 4294967295
  %low1 = shl i64 %s1, 32
  %low = or i64 %low0, %low1
  %h0 = lshr i64 %s1, 32
  %h1 = lshr i64 %lh, 32
  %h2 = lshr i64 %hl, 32
  %t0 = add i64 %hh, %h0
  %t1 = add i64 %t0, %h1
  %t2 = add i64 %t1, %h2
  %x0 = mul i64 %a0, %b1
  %x1 = mul i64 %a1, %b0
  %t3 = add i64 %t2, %x0
  %t4 = add i64 %t3, %x1
  %lo = zext i64 %low to i128
  %hi0 = zext i64 %t4 to i128
  %hi = shl i128 %hi0, 64
  %r = or i128 %hi, %lo
  ret i128 %r
}
"""


Exports = Mapping[str, tuple[Any, tuple[Any, ...]]]
"""The kernels that a module exports, by name, with examples of their arguments: NamedTuples marked
with `by_pointer`, and numbers. The kernels return a number or nothing."""


@jit.kernel
def sine(x: float) -> float:
    """Return the sine of an angle [rad]."""
    return elementary.sincos(x)[0]


@jit.kernel
def cosine(x: float) -> float:
    """Return the cosine of an angle [rad]."""
    return elementary.sincos(x)[1]


@jit.kernel
def fused(a: float, b: float, c: float) -> float:
    """Return a·b + c, rounded once, for |a|, |b| < 2⁹⁹⁶.

    This is `elementary.fma_in_parts` without its branch, which no processor can predict.
    """
    high, low = elementary._product(a, b)
    rest, lower = elementary._sum(c, low)
    total, last = elementary._sum(high, rest)
    odd, error = elementary._sum(lower, last)
    bits, sign = np.float64(odd).view(np.int64), np.float64(error).view(np.int64)
    # If there is an error and the last bit is even, go one up or down, towards the error.
    change = (~bits & 1) & np.int64(error != 0.0)
    bits += change - 2 * (change & ((bits ^ sign) >> 63))
    return total + np.int64(bits).view(np.float64)


@jit.kernel
def arctangent(y: float, x: float) -> float:
    """Return the angle of the vector (x, y) [rad]."""
    return elementary.direction(x, y)


# x = k·ln 2 + r, and the polynomial of fdlibm's e_exp.c for |r| ≤ ln 2 / 2.
_PER_LN2, _LN2, _LN2_REST = (
    1.4426950408889634,
    6.93147180369123816490e-01,
    1.90821492927058770002e-10,
)
_P1, _P2, _P3 = 1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05
_P4, _P5 = -1.65339022054652515390e-06, 4.13813679705723846039e-08
_LEAST, _MOST = -708.0, 709.0  # the result is 0 or infinite beyond


@jit.kernel
def exponential(x: float) -> float:
    """Return eˣ to within one unit in the last place; results below e⁻⁷⁰⁸ become 0."""
    if not x > _LEAST:
        return 0.0 if x <= _LEAST else x
    if x > _MOST:
        return np.inf
    k = np.floor(x * _PER_LN2 + 0.5)
    high, low = x - k * _LN2, k * _LN2_REST
    r = high - low
    z = r * r
    c = r - z * (_P1 + z * (_P2 + z * (_P3 + z * (_P4 + z * _P5))))
    value = 1.0 + (r * c / (2.0 - c) - low + high)
    bits = np.float64(value).view(np.int64) + (np.int64(k) << 52)
    return np.int64(bits).view(np.float64)


# Replacements for a library's functions and for LLVM's intrinsics of these names.
_INSTEAD: dict[str, tuple[Any, int]] = {
    "sin": (sine, 1),
    "cos": (cosine, 1),
    "fma": (fused, 3),
    "exp": (exponential, 1),
    "atan2": (arctangent, 2),
}
_ROOT = "llvm.sqrt.f64"


def linker() -> list[str] | None:
    """Return the command of a WebAssembly linker, or None if none is installed."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "wasm-ld"]
    found = next((path for name in LINKERS if (path := shutil.which(name))), None)
    return None if found is None else [found]


def module(exports: Exports) -> bytes:
    """Return a WebAssembly module of kernels and everything that they call.

    For callers, integer arguments and results have 32 bits, and addresses are numbers. The module
    exports its memory and the address from which the memory is free (``__heap_base``).
    """
    command = linker()
    if command is None:
        raise RuntimeError(NO_LINKER)
    code = _object(_program(exports), exports)
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "engine.o"), Path(folder, "engine.wasm")
        source.write_bytes(code)
        shown = [f"--export={name}" for name in (*exports, "__heap_base")]
        settings = ["--no-entry", "--stack-first", "-z", f"stack-size={STACK}", "--strip-all"]
        arguments = [*command, *settings, *shown, str(source), "-o", str(target)]
        done = subprocess.run(arguments, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"kernels are not linked: {done.stderr.strip()}")
        return target.read_bytes()


def _program(exports: Exports) -> str:
    """Return all code in LLVM's language, before optimisation."""
    parts: dict[Any, str] = {}  # in the order of lowering

    def lowered(kernel: Any, signature: tuple[Any, ...]) -> str:
        compiled = _lowered(kernel, signature)
        for each in compiled.library.needed:  # the same code is listed for each caller
            if each not in parts:
                parts[each] = str(each._final_module)
        return compiled.fndesc.llvm_func_name

    shown = ""
    for name, (kernel, arguments) in exports.items():
        signature = tuple(numba.typeof(each) for each in arguments)
        inner, kinds = lowered(kernel, signature), [str(each) for each in signature]
        given = ", ".join(["ptr", "ptr", *(_KINDS.get(kind, _POINTER)[0] for kind in kinds)])
        result = str(_lowered(kernel, signature).signature.return_type)
        shown += f'declare i32 @"{inner}"({given})\n' + _caller(name, inner, kinds, result)
    own = {
        name: lowered(kernel, (types.float64,) * count)
        for name, (kernel, count) in _INSTEAD.items()
    }
    main = llvm.parse_assembly(_here(shown))
    for text in parts.values():
        main.link_in(llvm.parse_assembly(_here(text)))
    # Every processor has an instruction for the library's square root.
    text = str(main).replace("call double @sqrt(", f"call double @{_ROOT}(")
    if f"declare double @{_ROOT}(" not in text:
        text += f"\ndeclare double @{_ROOT}(double)\n"
    for name, (_, count) in _INSTEAD.items():
        stand_in = f"magfold.{name}"
        used = re.compile(rf'(call [^@\n]*double) @"?(?:{name}|llvm\.{name}\.f64)"?\(')
        text, times = used.subn(rf'\1 @"{stand_in}"(', text)
        if times:
            text += _caller(
                stand_in, own[name], ["float64"] * count, "float64", "internal", "alwaysinline"
            )
    return text + _MULTIPLY


@cache
def _lowered(kernel: Any, signature: tuple[Any, ...]) -> Any:
    """Return numba's result for a kernel, translated to LLVM's language but not optimised."""
    made = cast("Any", numba.njit)(
        pipeline_class=numba_private.LoweringCompiler,
        no_cpython_wrapper=True,
        no_cfunc_wrapper=True,
        error_model="numpy",
        nogil=True,
        _nrt=False,
    )(getattr(kernel, "py_func", kernel))
    made.compile(signature)
    return made.overloads[signature]


def _here(text: str) -> str:
    """Return the code changed to target WebAssembly instead of this machine."""
    lines = [line for line in text.splitlines() if not line.startswith("target ")]
    target = f'target datalayout = "{_machine().target_data}"\ntarget triple = "{TRIPLE}"'
    return "\n".join([target, *lines])


def _machine() -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(TRIPLE)
    return target.create_target_machine(opt=3, reloc="static", features=FEATURES)


def _caller(
    name: str, inner: str, kinds: Sequence[str], result: str, linkage: str = "", how: str = ""
) -> str:
    """Return a function that calls a kernel by numba's convention, for callers that do not use it.

    ``kinds`` and ``result`` are numba's types of the arguments and the result.
    """
    given, passed, lines = [], ["ptr %out", "ptr %error"], []
    for k, kind in enumerate(kinds):
        inside, outside = _KINDS.get(kind, _POINTER)
        given.append(f"{outside} %a{k}")
        wide = inside != outside
        if wide:
            lines.append(f"  %w{k} = sext {outside} %a{k} to {inside}")
        passed.append(f"{inside} %{'w' if wide else 'a'}{k}")
    inside, outside = _KINDS.get(result, ("ptr", "void"))
    lines.append(f'  %status = call i32 @"{inner}"({", ".join(passed)})')
    if outside != "void":
        lines.append(f"  %value = load {inside}, ptr %out")
    if outside == "i32":
        lines.append(f"  %short = trunc {inside} %value to i32")
    returned = {"void": "", "i32": "%short"}.get(outside, "%value")
    return "\n".join(
        [
            f'define {linkage} {outside} @"{name}"({", ".join(given)}) {how} {{',
            f"  %out = alloca {inside}",
            "  %error = alloca ptr",
            *lines,
            f"  ret {outside} {returned}",
            "}\n",
        ]
    )


def _object(text: str, exports: Exports) -> bytes:
    """Return an object file that exports only these functions."""
    program = llvm.parse_assembly(text)
    program.verify()
    kept = {*exports, "__multi3"}
    for each in (*program.functions, *program.global_variables):
        if not each.is_declaration and each.name not in kept:
            each.linkage = "internal"
    machine = _machine()
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes = builder.getModulePassManager()
    passes.run(program, builder)
    missing = [
        each.name
        for each in program.functions
        if each.is_declaration and not each.name.startswith("llvm.")
    ]
    if missing:
        raise RuntimeError(f"kernels call what no browser has: {', '.join(missing)}")
    return machine.emit_object(program)
