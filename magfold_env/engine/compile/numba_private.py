# Numba's own modules have no type annotations.
# pyright: basic

"""The engine's use of private parts of numba, which may change without notice.

*Deferred compilation.* Numba compiles each function completely, and each caller again with
everything that it calls: in a deep call tree, the leaves are optimised once per level, and most of
the results never run. A kernel that another one calls is therefore only *lowered*: its types are
inferred and its code is generated, but not linked or optimised. A kernel that Python calls links
all lowered code below it and optimises it together.

*Indices.* They never count from the end in lowered code: numba would test the sign of each, which
takes a quarter of all instructions.

*Quicker passes.* While numba lowers a kernel, cached and shorter versions replace the functions
that take it longest. They lead to equal machine code, except for items of arrays.

*Files of kernels.* They are loaded without registering everything that numba can compile. A file
begins with a hash of its contents; if anything is wrong with it, the kernel is compiled again.

`check` tests both features, and `pointer_types`, on a small example.
"""

import hashlib
import os
import pickle
import re
import tempfile
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import numba
import numpy as np
from llvmlite import binding  # pyright: ignore[reportMissingTypeStubs]
from numba.core import ir, types
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.postproc import PostProcessor
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import InlineOverloads, NativeLowering, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes, WithLifting
from numba.extending import intrinsic
from numba.np import arrayobj

from magfold_env.engine.compile import pointer_types
from magfold_env.engine.compile.kernel_cache import (
    cache_directory,
    fingerprint,
    shipped_directory,
    shipped_levels,
    write,
)

# Type checkers do not see all options in its signature.
_njit = cast("Any", numba.njit)
_core = cast("Any", numba).core
_dynfunc = cast("Any", numba)._dynfunc
_llvm = cast("Any", binding)

# Passes for features that no kernel uses: closures, ``with`` blocks, whole-array expressions.
NEEDLESS = (WithLifting, InlineClosureLikes, InlineOverloads, NopythonRewrites)


@cast("Any", intrinsic)
def fma(_typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a·b + c, always rounded only once, which a compiler flag would not guarantee."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


# --- deferred compilation ------------------------------------------------------------------


class _LoweredCode(JITCodeLibrary):
    """Code of one kernel that its callers link and optimise."""

    def finalize(self) -> None:
        """Mark the code as final, without optimising it."""
        self._raise_if_finalized()
        self._finalized = True

    @property
    def needed(self) -> list[Any]:
        """Return what a caller has to link: this code, and all code that it calls."""
        return [self, *self._linking_libraries]


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOnly(NativeLowering):
    """Numba's pass that generates code, but without compiling it."""

    _name = "lowering_only"

    def run_pass(self, state: Any) -> Any:
        context = state.targetctx
        lowered = _LoweredCode(context.codegen(), state.func_id.func_qualname)
        state.library, state.flags.no_compile = lowered, True
        # Numba would parse a module to learn a number's size, for every variable.
        context.get_abi_sizeof = partial(_size, context)
        counted, arrayobj.fix_integer_index = arrayobj.fix_integer_index, _from_begin
        try:
            super().run_pass(state)
        finally:
            del context.get_abi_sizeof
            arrayobj.fix_integer_index = counted
        lowered.finalize()
        written = state["cr"]
        # Numba looks up code by the function that Python would call, but this one has no address.
        code = written.fndesc
        name = _dynfunc.make_function(
            code.lookup_module(), code.qualname, "lowered", 0, written.env, (lowered,)
        )
        context.insert_user_function(name, code, lowered.needed)
        state["cr"] = written._replace(cfunc=name)
        return True


def _from_begin(context: Any, builder: Any, kind: Any, index: Any, _size: Any) -> Any:
    """Return an index that does not count from the end, in place of numba's function."""
    return context.cast(builder, index, kind, types.intp)


@cache
def _size(context: Any, kind: Any) -> int:
    return type(context).get_abi_sizeof(context, kind)


_call_type = types.BaseFunction.get_call_type
_get_function = BaseContext.get_function
_find_lifetimes = PostProcessor.run
_known: dict[Any, Any] = {}


def _known_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of a call; numba would look it up for every operator in the code."""
    key = self, tuple(args)
    found = None if kws else _known.get(key)
    if found is None:
        found = _call_type(self, context, args, kws)
        if not kws:
            _known[key] = found
    return found


def _function(self: Any, fn: Any, sig: Any, _firstcall: bool = True) -> Any:
    """Return the generator of a function's code; see `pointer_types.item_code`."""
    # Numba would register everything that it knows again for each array.
    first = _firstcall and fn != "__array__"
    return pointer_types.item_code(fn, sig, self) or _get_function(self, fn, sig, first)


def _post_process(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Bring a kernel's blocks in order; find lifetimes only if they are about to be written."""
    if emit_dels:
        _find_lifetimes(self, emit_dels, extend_lifetimes)
    else:
        self.func_ir.blocks = canonicalize_cfg(self.func_ir.blocks)


def _list_vars(self: Any) -> list[Any]:
    """Return the variables of an instruction, in its order."""
    found: list[Any] = []
    left = [*self.__dict__.values()][::-1]
    while left:
        value = left.pop()
        kind = type(value)
        if kind is ir.Var:
            found.append(value)
        elif kind is list or kind is tuple:
            left += value[::-1]
        elif kind is dict:
            left += [*value.values()][::-1]
        elif isinstance(value, ir.Inst):
            found += value.list_vars()
    return found


QUICKER = (
    (types.BaseFunction, "get_call_type", _known_call_type),
    (BaseContext, "get_function", _function),
    (PostProcessor, "run", _post_process),
    (ir.Stmt, "list_vars", _list_vars),
    (ir.Expr, "list_vars", _list_vars),
)


class _Passes(PassManager):
    """Numba's passes, without what it checks and measures between them."""

    @global_compiler_lock
    def run(self, state: Any) -> None:
        """Run all passes, with quicker versions of what takes numba longest."""
        before = [getattr(owner, name) for owner, name, _ in QUICKER]
        for owner, name, quicker in QUICKER:
            setattr(owner, name, quicker)
        try:
            for each, _ in self.passes:
                one = _pass_registry.get(each).pass_inst
                one.analysis = self._analysis
                one.run_pass(state)
        finally:
            for (owner, name, _), each in zip(QUICKER, before, strict=True):
                setattr(owner, name, each)


class LoweringCompiler(CompilerBase):
    """Numba's compiler with a last pass that generates code but does not compile it."""

    def define_pipelines(self) -> list[PassManager]:
        """Return the compiler's passes."""
        manager = _Passes("lowering")
        manager.passes = [
            (_LoweringOnly if each is NativeLowering else each, why)
            for each, why in DefaultPassBuilder.define_nopython_pipeline(self.state).passes
            if each not in NEEDLESS
        ]
        manager.finalize()
        return [manager]


def defer(kernel: Any, **options: Any) -> None:
    """Make kernels that call this one compile its lowered code themselves.

    Constant arguments count as plain numbers, because each constant would need separate code.

    Parameters
    ----------
    kernel
        A function compiled by numba.
    options
        Options with which it was compiled.
    """

    @cache
    def lowered() -> Any:  # created at the first call, which most loaded kernels never get
        without = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        made = _njit(pipeline_class=LoweringCompiler, **{**options, **without})
        return made(kernel.py_func)

    def template(args: Any, kws: Any) -> Any:
        plain = tuple(types.unliteral(each) for each in args)
        return lowered().get_call_template(plain, {k: types.unliteral(v) for k, v in kws.items()})

    kernel.get_call_template = template
    kernel.get_overload = lambda signature: lowered().get_overload(signature)


# --- files of kernels ----------------------------------------------------------------------


class KernelFiles:
    """The cache that numba asks before it compiles a function, and to which it gives the result.

    Parameters
    ----------
    kernel
        A function compiled by numba.
    directory
        Directory of its files; None if nothing can be written. The wheel's files are in another.
    linked
        Whether compiled code may be linked into other kernels, which needs its intermediate code.
    """

    def __init__(self, kernel: Any, directory: Path | None, *, linked: bool) -> None:
        self._kernel, self._directory, self._linked = kernel, directory, linked
        self.cache_path = str(directory)  # numba shows it

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code compiled for a signature; None if it is missing or damaged."""
        # Numba's own caches first refresh the context, which takes half a second to register
        # everything that can be compiled. Compiled code needs only the memory runtime.
        _core.runtime.rtsys.initialize(target_context)
        processor = target_context.codegen().magic_tuple()
        places = [(self._directory, processor)] if self._directory else []
        places += [(shipped_directory(), each) for each in shipped_levels(processor)]
        for directory, kind in places:
            path = self._path(directory, sig, kind)
            with suppress(Exception):
                content = path.read_bytes()
                size = hashlib.sha256().digest_size
                if hashlib.sha256(content[size:]).digest() != content[:size]:
                    continue
                payload = pickle.loads(content[size:])
                found = _core.compiler.CompileResult._rebuild(target_context, *payload)
                with suppress(OSError):
                    os.utime(path)  # marks it as recently used
                return found
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store code compiled for a signature, unless it contains addresses of this process."""
        if self._directory and not data.library.has_dynamic_globals and not data.lifted:
            (name, kind, (machine_code, intermediate)), *rest = data._reduce()
            if not self._linked:
                intermediate = names_alone(intermediate)
            library = name, kind, (machine_code, intermediate)
            content = _core.serialize.dumps((library, *rest))
            path = self._path(self._directory, sig, data.library.codegen.magic_tuple())
            write(path, hashlib.sha256(content).digest() + content)

    def _path(self, directory: Path, sig: Any, processor: Any) -> Path:
        function = self._kernel.py_func
        key = repr((fingerprint(self._kernel), str(sig), processor))
        name = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}"
        digest = hashlib.sha256(key.encode()).hexdigest()[:16]
        return directory / f"{re.sub('[<>]', '', name)}.{digest}.nbc"


def names_alone(intermediate: bytes) -> bytes:
    """Reduce intermediate code to the names that it defines; numba looks up nothing else.

    Reading all of it would take half of a kernel's load time.
    """
    module = _llvm.parse_bitcode(intermediate)
    symbols = (*module.functions, *module.global_variables)
    names = [each.name for each in symbols if not each.is_declaration]
    stubs = "\n".join(f'define void @"{name}"() {{ ret void }}' for name in names)
    return _llvm.parse_assembly(stubs).as_bitcode()


def keep(kernel: Any, *, linked: bool) -> None:
    """Store a kernel's compiled code on disk, and load it from there; see `KernelFiles`.

    A kernel that closes over variables is compiled in every process.
    """
    if kernel.py_func.__closure__ is None:
        kernel._cache = KernelFiles(kernel, cache_directory(), linked=linked)


# --- whether numba behaves as expected -----------------------------------------------------


class _Inner(pointer_types.Packed, NamedTuple("_Inner", [("scale", float), ("row", np.ndarray)])):
    pass


class _Outer(
    pointer_types.Packed,
    NamedTuple("_Outer", [("on", bool), ("inner", _Inner), ("cube", np.ndarray)]),
):
    pass


def check() -> None:
    """Raise an error unless kernels read tuples, call each other, and load correctly.

    Also raises an error if a kernel that others call is compiled separately.
    """

    @_njit
    def leaf(outer: Any, x: float) -> float:
        k = outer.inner.row.size - 1
        outer.inner.row[k - 1] += 1.0
        at = outer.cube[k, k - 1, k + 1]
        total = outer.inner.scale * outer.inner.row[k] + at * outer.cube.shape[2]
        return total + fma(x, 10.0, -1.0) * 2.0**54 if outer.on else x

    @_njit
    def branch(outer: Any, x: float) -> float:
        return leaf(outer, x) + leaf(outer, x)

    @_njit
    def root(one: Any, two: Any, three: Any, x: float) -> float:
        return branch(one, x) + leaf(two, x) + leaf(three, x)

    @_njit
    def call(code: int, address: int, counter: Any) -> float:
        found = pointer_types.call_float(code, address, address, address, 0.1)
        return found + pointer_types.take(counter) + pointer_types.take(counter)

    defer(leaf)
    defer(branch)
    row, counter = np.array([3.0, 7.0]), np.array([4])
    outer = _Outer(True, _Inner(0.25, row), np.arange(6.0).reshape(2, 1, 3))
    expected = 4.0 * (0.25 * 7.0 + 5.0 * 3 + 1.0)
    if root(outer, outer.pointer, outer, 0.1) != expected or row.tolist() != [7.0, 7.0]:
        raise RuntimeError("a kernel gives another result")
    if leaf.signatures or branch.signatures:
        raise RuntimeError("what a kernel calls is compiled by itself")
    code = pointer_types.code_of(root, outer, outer, outer, 0.1)
    if call(code, outer.address, counter) != expected + 4 + 5 or counter.tolist() != [6]:
        raise RuntimeError("a kernel called by its address gives another result")
    (signature,) = root.overloads
    with tempfile.TemporaryDirectory() as folder:
        kept = KernelFiles(root, Path(folder), linked=False)
        kept.save_overload(signature, root.overloads[signature])
        found = kept.load_overload(signature, root.targetctx)
    if found is None or found.entry_point(outer, outer, outer, 0.1) != expected:
        raise RuntimeError("what was kept is not found again")
