# Numba's own modules know no types.
# pyright: basic

"""Deferred compilation: kernels that kernels call are compiled once, within what Python calls.

Numba compiles every function to the end, and every caller again with all that it calls: in a deep
tree of calls the leaves are optimised once a level, and most of what that yields is never run. So
the code of a kernel that another calls is only *lowered* for it: types inferred and code written
down, but neither linked nor optimised. What Python calls links all lowered code below it and
optimises it together.
"""

from functools import cache, partial
from typing import Any, ClassVar, cast

import numba
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import InlineOverloads, NativeLowering, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes, WithLifting

# Not in the signatures that type checkers see.
_njit = cast("Any", numba.njit)
_dynfunc = cast("Any", numba)._dynfunc

# Passes for what no kernel does: closures, ``with`` blocks, expressions of whole arrays.
NEEDLESS = (WithLifting, InlineClosureLikes, InlineOverloads, NopythonRewrites)


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


class _LoweringCompiler(CompilerBase):
    def define_pipelines(self) -> list[PassManager]:
        """Return numba's passes, the last of them without compilation."""
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
        With which it was compiled, but for caching.
    """

    @cache
    def lowered() -> Any:  # made when it is first called: most that are loaded never are
        return _njit(
            pipeline_class=_LoweringCompiler,
            no_cpython_wrapper=True,
            no_cfunc_wrapper=True,
            **options,
        )(kernel.py_func)

    def template(args: Any, kws: Any) -> Any:
        plain = tuple(types.unliteral(each) for each in args)
        return lowered().get_call_template(plain, {k: types.unliteral(v) for k, v in kws.items()})

    kernel.get_call_template = template
    kernel.get_overload = lambda signature: lowered().get_overload(signature)


def check() -> None:
    """Raise an error unless a kernel that calls two levels of others does what it should."""

    @_njit
    def leaf(x: float, k: int) -> float:
        return x + k

    @_njit
    def branch(x: float) -> float:
        return leaf(x, 1) * leaf(x, 2)

    @_njit
    def root(x: float) -> float:
        return branch(x) + leaf(x, 3)

    defer(leaf)
    defer(branch)
    if root(0.5) != 1.5 * 2.5 + 3.5:
        raise RuntimeError("a kernel compiled with what it calls gives another result")
    if leaf.signatures or branch.signatures:
        raise RuntimeError("what a kernel calls is compiled by itself")
