# Numba's own modules know no types.
# pyright: basic

"""Kernels that kernels call, compiled once, within what Python calls.

Numba compiles every function to the end, and every caller again with all that it calls: in a deep
tree of calls the leaves are optimised once a level, and most of what that yields is never run. So
a kernel that calls another is given a *draft* of it: types inferred and code written down, but
neither linked nor optimised. What Python calls links all drafts below it and optimises them
together.
"""

from __future__ import annotations

from typing import Any, cast

import numba
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering

# Not in the signatures that type checkers see.
_njit = cast("Any", numba.njit)
_dynfunc = cast("Any", numba)._dynfunc


class _Draft(JITCodeLibrary):
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
class _DraftLowering(NativeLowering):
    """Write the code down, but do not compile it."""

    _name = "draft_lowering"

    def run_pass(self, state: Any) -> Any:
        context = state.targetctx
        draft = _Draft(context.codegen(), state.func_id.func_qualname)
        state.library, state.flags.no_compile = draft, True
        super().run_pass(state)
        draft.finalize()
        written = state["cr"]
        # Numba looks code up by the function that Python would call. This one has no address.
        code = written.fndesc
        name = _dynfunc.make_function(
            code.lookup_module(), code.qualname, "draft", 0, written.env, (draft,)
        )
        context.insert_user_function(name, code, draft.needed)
        state["cr"] = written._replace(cfunc=name)
        return True


class _DraftCompiler(CompilerBase):
    def define_pipelines(self) -> list[PassManager]:
        """Return numba's passes, with drafts for compiled code."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [
            (_DraftLowering if each is NativeLowering else each, why)
            for each, why in manager.passes
        ]
        manager.finalize()
        return [manager]


def hand_drafts(kernel: Any, **options: Any) -> None:
    """Let kernels that call this one have drafts of it.

    Constants among the arguments count as numbers: each would make for another draft.

    Parameters
    ----------
    kernel
        A function compiled by numba.
    options
        With which it was compiled, but for caching.
    """
    drafts = _njit(
        pipeline_class=_DraftCompiler, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options
    )(kernel.py_func)

    def template(args: Any, kws: Any) -> Any:
        plain = tuple(types.unliteral(each) for each in args)
        return drafts.get_call_template(plain, {k: types.unliteral(v) for k, v in kws.items()})

    kernel.get_call_template = template
    kernel.get_overload = drafts.get_overload
