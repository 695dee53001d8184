"""Tests without numba's private interface: one warning, and identical results."""

import ast
from pathlib import Path

import numba
import pytest

import magfold_env
from magfold_env.engine.compile.jit import numba_config
from tests.command_line import python

compiled = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")

# What a later numba might do.
CHANGES = {
    "no libraries of code": """
import numba.core.codegen
del numba.core.codegen.JITCodeLibrary
""",
    "no attributes of any name": """
import numba.extending
del numba.extending.lower_getattr_generic
""",
    "no products that are rounded with a sum": """
from llvmlite import ir
del ir.IRBuilder.fma
""",
    "other files of kernels": """
from numba.core import caching, compiler
compiler.CompileResult._payload = compiler.CompileResult._reduce
caching.CompileResultCacheImpl.reduce = lambda self, result: result._payload()
del compiler.CompileResult._reduce
""",
    "other events": """
from numba.core import event
event.Listener.on_begin = event.Listener.on_start
event.Listener.__abstractmethods__ |= {"on_begin"}
""",
}

KERNELS = """
import numpy as np
from tests.engine.compile.test_by_pointer import an_outer, read, scale_row, twice
from tests.engine.test_arithmetic import fused, sincos_of
outer, x = an_outer(), np.array([0.0, 0.3, -1.0, 2.5, -1e3, 1e14])
scale_row(outer)
sine, cosine = np.zeros((2, x.size))
sincos_of(x, sine, cosine)
numbers = [*read(outer, 0), *read(outer, 1), twice(outer.cube[0]), fused(0.1, 10.0, -1.0)]
print([float(each).hex() for each in (*numbers, *outer.row, *sine, *cosine)])
"""


def run(change: str, cache: Path) -> tuple[str, list[str]]:
    """Run kernels in a separate process; return its output and numba's warnings."""
    done = python("-c", change + KERNELS, check=False, NUMBA_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    return done.stdout, [line for line in done.stderr.splitlines() if "Warning: numba" in line]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the output of the kernels with unchanged numba."""
    printed, warned = run("", tmp_path_factory.mktemp("cache"))
    assert not warned
    return printed


@pytest.mark.medium
@compiled
@pytest.mark.parametrize("change", CHANGES)
def test_kernels_do_the_same_without(change, expected, tmp_path):
    for _ in range(2):  # compiled, and loaded
        printed, warned = run(CHANGES[change], tmp_path)
        assert printed == expected
        (warning,) = warned
        assert f"RuntimeWarning: numba {numba.__version__} differs from what" in warning


@pytest.mark.medium
@compiled
def test_without_a_compiler_they_are_the_same(expected, tmp_path):
    assert run("import os; os.environ['NUMBA_DISABLE_JIT'] = '1'", tmp_path) == (expected, [])


def test_no_kernel_counts_from_the_end():
    marks = {"kernel", "inlined", "interpreted", "allocating_kernel", "parallel_kernel"}
    marks.add("calls_by_address")
    for path in Path(magfold_env.__file__).parent.rglob("*.py"):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(function, ast.FunctionDef):
                continue
            if marks.isdisjoint(ast.unparse(each) for each in function.decorator_list):
                continue
            for each in ast.walk(function):
                if isinstance(each, ast.Subscript):
                    indices = each.slice.elts if isinstance(each.slice, ast.Tuple) else [each.slice]
                    assert not any(isinstance(index, ast.UnaryOp) for index in indices), (
                        f"{path.name}: {ast.unparse(each)}"
                    )
