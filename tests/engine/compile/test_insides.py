"""Without what numba promises to nobody: one warning, and the same bits."""

import os
import subprocess
import sys
from fractions import Fraction
from types import SimpleNamespace

import numba
import numpy as np
import pytest

from magfold_env.engine.compile import insides
from magfold_env.engine.compile.insides import numba_config
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.elementary import fma, fma_in_parts

compiled = pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")

# What a later numba might do to each.
CHANGES = {
    "deferred": """
import numba.core.codegen
del numba.core.codegen.JITCodeLibrary
""",
    "pointer_types": """
import numba.extending
del numba.extending.lower_getattr_generic
""",
    "fused": """
from llvmlite import ir
del ir.IRBuilder.fma
""",
    "kernel_cache": """
from numba.core import caching, compiler
compiler.CompileResult._payload = compiler.CompileResult._reduce
caching.CompileResultCacheImpl.reduce = lambda self, result: result._payload()
del compiler.CompileResult._reduce
""",
    "first_use": """
from numba.core import event
event.Listener.on_begin = event.Listener.on_start
event.Listener.__abstractmethods__ |= {"on_begin"}
""",
}

SMALL = """
import numpy as np
from small import Outer, Inner, outer_of, root
print([each.hex() for each in root(outer_of(0.3))])
"""
SMALL_MODULE = """
from typing import NamedTuple
import numpy as np
from magfold_env.engine.elementary import sincos
from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import allocating_kernel, inlined, kernel

@by_pointer
class Inner(NamedTuple):
    scale: float
    row: np.ndarray

@by_pointer
class Outer(NamedTuple):
    on: bool
    inner: Inner

def outer_of(x):
    return Outer(True, Inner(x, np.linspace(0.1, 0.7, 5)))

@inlined
def square(x):
    return x * x

@kernel
def branch(outer, k):
    s, c = sincos(outer.inner.row[k])
    return square(s) * outer.inner.scale + c if outer.on else s

@allocating_kernel
def root(outer):
    out = np.empty(outer.inner.row.size)
    for k in range(out.size):
        out[k] = branch(outer, k) + branch(outer, 0)
    return out
"""


def run(code: str, cache: str, folder: str) -> tuple[str, list[str]]:
    """Run code in a process of its own; returns what it prints, and the warnings of numba."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*sys.path, folder])}
    if cache:
        environment["NUMBA_CACHE_DIR"] = cache
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, [line for line in done.stderr.splitlines() if "Warning: numba" in line]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """Return the folder of some small kernels, and what they print with numba as it is."""
    folder = tmp_path_factory.mktemp("small")
    (folder / "small.py").write_text(SMALL_MODULE)
    printed, warned = run(SMALL, str(folder / "cache"), str(folder))
    assert not warned
    return str(folder), printed


@pytest.mark.medium
@compiled
@pytest.mark.parametrize("inside", CHANGES)
def test_kernels_do_the_same_without(inside, small, tmp_path):
    folder, expected = small
    for _ in range(2):  # compiled, and loaded
        printed, warned = run(CHANGES[inside] + SMALL, str(tmp_path), folder)
        assert printed == expected
        (warning,) = warned
        assert f"RuntimeWarning: numba {numba.__version__} differs from what" in warning


def test_what_fails_its_check_is_not_used(monkeypatch, tmp_path):
    def check() -> None:
        raise TypeError("other arguments")

    broken = SimpleNamespace(check=check)
    monkeypatch.setitem(sys.modules, "magfold_env.engine.compile.broken", broken)
    monkeypatch.setattr(insides.kernel_cache, "cache_directory", lambda file: tmp_path)
    with pytest.warns(RuntimeWarning, match=r"so that .* \(TypeError: other arguments\)"):
        assert insides.load("broken", "so that it takes longer") is None
    assert not list(tmp_path.iterdir())


@kernel
def fused(a: float, b: float, c: float) -> float:
    return fma(a, b, c)


@kernel
def in_parts(a: float, b: float, c: float) -> float:
    return fma_in_parts(a, b, c)


def test_a_product_and_a_sum_are_rounded_once():
    rng = np.random.default_rng(0)
    for _ in range(2000):
        a, b = rng.normal(size=2) * 10.0 ** rng.integers(-20, 20, 2)
        c = -a * b * (1.0 + rng.normal() * 10.0 ** rng.integers(-18, 3))
        expected = float(Fraction(a) * Fraction(b) + Fraction(c))
        assert fused(a, b, c) == in_parts(a, b, c) == expected


SINES = """
from magfold_env.engine.elementary import sincos
print([each.hex() for x in (0.0, 0.3, -1.0, 2.5, -1e3, 1e14) for each in map(float, sincos(x))])
"""


@pytest.mark.medium
@compiled
def test_sines_without_a_compiler_are_those_with_one():
    with_one, _ = run(SINES, "", "")
    without, warned = run("import os; os.environ['NUMBA_DISABLE_JIT'] = '1'" + SINES, "", "")
    assert without == with_one
    assert not warned
