# Numba's own modules know no types.
# pyright: basic

"""What the engine does through parts of numba that numba promises to nobody.

*Deferred compilation.* Numba compiles every function to the end, and every caller again with all
that it calls: in a deep tree of calls the leaves are optimised once a level, and most of what that
yields is never run. So the code of a kernel that another calls is only *lowered* for it: types
inferred and code written down, but neither linked nor optimised. What Python calls links all
lowered code below it and optimises it together.

*Files of kernels*, which are loaded without registering all that numba can compile. A file begins
with a hash of the rest of it; whatever is wrong with one, the kernel is compiled again.

`check` tries them and `pointer_types` on something small.
"""

import hashlib
import os
import pickle
import re
import tempfile
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, cast

import numba
import numpy as np
from llvmlite import binding  # pyright: ignore[reportMissingTypeStubs]
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import InlineOverloads, NativeLowering, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes, WithLifting
from numba.extending import intrinsic

from magfold_env.engine.compile import pointer_types
from magfold_env.engine.compile.kernel_cache import cache_directory, fingerprint, write

# Not in the signatures that type checkers see.
_njit = cast("Any", numba.njit)
_core = cast("Any", numba).core
_dynfunc = cast("Any", numba)._dynfunc
_llvm = cast("Any", binding)

# Passes for what no kernel does: closures, ``with`` blocks, expressions of whole arrays.
NEEDLESS = (WithLifting, InlineClosureLikes, InlineOverloads, NopythonRewrites)


@cast("Any", intrinsic)
def fma(_typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a·b + c, rounded once: not the flag that lets the compiler choose."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


# --- deferred compilation ------------------------------------------------------------------


class _LoweredCode(JITCodeLibrary):
    """Code of one kernel that is left to its callers to link and to optimise."""

    def finalize(self) -> None:
        """Close the code as it stands."""
        self._raise_if_finalized()
        self._finalized = True

    @property
    def needed(self) -> list[Any]:
        """What a caller has to link: this code, and all that it calls."""
        return [self, *self._linking_libraries]


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOnly(NativeLowering):
    """Write the code down, but do not compile it."""

    _name = "lowering_only"

    def run_pass(self, state: Any) -> Any:
        context = state.targetctx
        lowered = _LoweredCode(context.codegen(), state.func_id.func_qualname)
        state.library, state.flags.no_compile = lowered, True
        # Numba has a module parsed to learn the size of a number, for every variable.
        context.get_abi_sizeof = partial(_size, context)
        try:
            super().run_pass(state)
        finally:
            del context.get_abi_sizeof
        lowered.finalize()
        written = state["cr"]
        # Numba looks code up by the function that Python would call. This one has no address.
        code = written.fndesc
        name = _dynfunc.make_function(
            code.lookup_module(), code.qualname, "lowered", 0, written.env, (lowered,)
        )
        context.insert_user_function(name, code, lowered.needed)
        state["cr"] = written._replace(cfunc=name)
        return True


@cache
def _size(context: Any, kind: Any) -> int:
    return type(context).get_abi_sizeof(context, kind)


class _Remembering:
    """Numba's typing context, which looks up what an operator makes of some types only once."""

    found: ClassVar[dict[Any, Any]] = {}

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call."""
        if kws or not isinstance(function, types.BaseFunction):
            return self._context.resolve_function_type(function, args, kws)
        key = function, tuple(args)
        if key not in self.found:
            signature = self._context.resolve_function_type(function, args, kws)
            if signature is None:
                return None
            self.found[key] = signature
        return self.found[key]


class LoweringCompiler(CompilerBase):
    """Numba's compiler, the last of whose passes writes code down but does not compile it."""

    def define_pipelines(self) -> list[PassManager]:
        """Return the passes."""
        self.state.typingctx = _Remembering(self.state.typingctx)
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [
            (_LoweringOnly if each is NativeLowering else each, why)
            for each, why in manager.passes
            if each not in NEEDLESS
        ]
        manager.finalize()
        return [manager]


def defer(kernel: Any, **options: Any) -> None:
    """Let kernels that call this one have its code lowered, and compile it themselves.

    Constants among the arguments count as numbers: each would make for other code.

    Parameters
    ----------
    kernel
        A function compiled by numba.
    options
        With which it was compiled.
    """

    @cache
    def lowered() -> Any:  # made when it is first called: most that are loaded never are
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
    """What numba asks for machine code before it compiles a function, and gives it to afterwards.

    Parameters
    ----------
    kernel
        A function compiled by numba.
    directory
        Where its files are.
    linked
        Whether it may be linked into others as it is compiled, which takes its intermediate code.
    """

    def __init__(self, kernel: Any, directory: Path, *, linked: bool) -> None:
        self._kernel, self._linked = kernel, linked
        self.cache_path = str(directory)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature; None if it is not there or damaged."""
        # Numba's own caches refresh the context first: half a second, in which all that can be
        # compiled is registered. Compiled code needs no more than the runtime for memory.
        _core.runtime.rtsys.initialize(target_context)
        path = self._path(sig, target_context.codegen())
        try:
            content = path.read_bytes()
            size = hashlib.sha256().digest_size
            if hashlib.sha256(content[size:]).digest() != content[:size]:
                return None
            payload = pickle.loads(content[size:])
            found = _core.compiler.CompileResult._rebuild(target_context, *payload)
        except Exception:
            return None
        with suppress(OSError):
            os.utime(path)  # it is in use
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, unless it holds addresses of this process."""
        if not data.library.has_dynamic_globals and not data.lifted:
            (name, kind, (machine_code, intermediate)), *rest = data._reduce()
            if not self._linked:
                intermediate = names_alone(intermediate)
            library = name, kind, (machine_code, intermediate)
            content = _core.serialize.dumps((library, *rest))
            path = self._path(sig, data.library.codegen)
            write(path, hashlib.sha256(content).digest() + content)

    def _path(self, sig: Any, codegen: Any) -> Path:
        function = self._kernel.py_func
        key = repr((fingerprint(self._kernel), str(sig), codegen.magic_tuple()))
        name = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}"
        digest = hashlib.sha256(key.encode()).hexdigest()[:16]
        return Path(self.cache_path) / f"{re.sub('[<>]', '', name)}.{digest}.nbc"


def names_alone(intermediate: bytes) -> bytes:
    """Return intermediate code that defines the same names, which is all that numba looks up in it.

    Reading all of it takes half the time that a kernel takes to load.
    """
    module = _llvm.parse_bitcode(intermediate)
    symbols = (*module.functions, *module.global_variables)
    names = [each.name for each in symbols if not each.is_declaration]
    stubs = "\n".join(f'define void @"{name}"() {{ ret void }}' for name in names)
    return _llvm.parse_assembly(stubs).as_bitcode()


def keep(kernel: Any, *, linked: bool) -> None:
    """Keep what is compiled of a kernel on disk, and load it from there; see `KernelFiles`.

    One that closes over variables is compiled anew in every process.
    """
    directory = cache_directory()
    if directory is not None and kernel.py_func.__closure__ is None:
        kernel._cache = KernelFiles(kernel, directory, linked=linked)


# --- whether numba is as it is taken to be -------------------------------------------------


class _Inner(pointer_types.Packed, NamedTuple("_Inner", [("scale", float), ("row", np.ndarray)])):
    pass


class _Outer(
    pointer_types.Packed,
    NamedTuple("_Outer", [("on", bool), ("inner", _Inner), ("cube", np.ndarray)]),
):
    pass


def check() -> None:
    """Raise an error unless kernels read tuples, call each other, and are loaded, as they should.

    Those that others call must not be compiled by themselves.
    """

    @_njit
    def leaf(outer: Any, x: float) -> float:
        outer.inner.row[0] += 1.0
        total = outer.inner.scale * outer.inner.row[1] + outer.cube[1, 0, 2] * outer.cube.shape[2]
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
