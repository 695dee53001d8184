"""`magfold warmup`: what it compiles is all that later uses need."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from magfold_env.engine.compile.jit import numba_config
from tests.command_line import run

# Kernels of benchmarks and of the slow references that laws are checked by.
MEASURING = ("magfold_env.benchmarks.", "magfold_env.laws.")


def test_everything_that_is_warmed_up_runs() -> None:
    result = run("warmup")
    assert result.exit_code == 0, result.stderr
    assert "kept on the disk" in result.stdout


@pytest.mark.slow
@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")
def test_no_kernel_is_left_to_be_compiled(tmp_path: Path) -> None:
    script = (
        "from magfold_env.cli.warmup import work\n"
        "from magfold_env.engine.compile.jit import KERNELS\n"
        "for each in work().values(): each()\n"
        "print([k.__module__ + '.' + k.__name__ for k in KERNELS if not k.overloads])"
    )
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    found = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "[]"
