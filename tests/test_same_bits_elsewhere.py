"""Tests of identical models and folds with other rounding, other libraries, or no compiler."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from magfold_env.engine.compile.jit import numba_config
from tests.command_line import python

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="is compared with compiled folds"),
]

SEQUENCE = ("NNSS", "SSNN", "NNNS", "NSSS", "NSNS")
MAGNET = {"position": (0.1, 0.05), "heading": 0.3, "width": 0.02, "height": 0.01, "thickness": 0.01}
SCENES: dict[str, dict[str, Any]] = {
    "free": {"mount": "free", "friction": 0.1},
    "tube": {"mount": "tube", "feed": {"speed": 0.03}},
    "sums": {"mount": "free", "magnets": {"accuracy": 1e-4}},
    "uneven": {"mount": "free", "magnets": {"remanence": (0.5, 0.6, 0.7, 0.8)}},
    "field": {"mount": "free", "field": {"uniform": (0.01, 0.003), "magnet": MAGNET}},
}
# Without splines, which take the interpreter minutes.
POINTS: dict[str, dict[str, Any]] = {
    "points": {"mount": "free", "magnets": {"model": "points"}, "duration": 0.1}
}
SCRIPT = """
import hashlib, json, sys
import numpy as np
import magfold_env as mf
from magfold_env.simulation.pack import pack

def numbers(x):
    if isinstance(x, tuple):
        return b"".join(map(numbers, x))
    return np.ascontiguousarray(x, dtype=np.float64).tobytes()

scenes, sequence = json.loads(sys.argv[1])
found = {}
for name, options in scenes.items():
    scene = mf.Scene(sequence=sequence, **options)
    fold = mf.simulate(scene, 1)
    found[name] = hashlib.sha256(numbers(pack(scene))).hexdigest(), fold.angles.tobytes().hex()
print(json.dumps(found))
"""


def folds(scenes: dict[str, dict[str, Any]], **changes: Any) -> dict[str, Any]:
    """Simulate in another process with a changed environment."""
    result = python("-c", SCRIPT, json.dumps([scenes, SEQUENCE]), **changes)
    return json.loads(result.stdout)


@pytest.mark.skipif(
    sys.platform != "linux", reason="the C library is told which loops to leave out"
)
def test_processors_decide_nothing(tmp_path: Path) -> None:
    umath = np._core._multiarray_umath  # pyright: ignore
    features = [name for name in umath.__cpu_dispatch__ if umath.__cpu_features__[name]]
    elsewhere = folds(
        SCENES, XDG_CACHE_HOME=str(tmp_path), NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="",
        NPY_DISABLE_CPU_FEATURES=" ".join(features), OPENBLAS_CORETYPE="Prescott",
        GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2,-FMA",
    )  # fmt: skip
    assert elsewhere == folds(SCENES)


def test_the_compiler_decides_nothing() -> None:
    assert folds(POINTS, NUMBA_DISABLE_JIT="1") == folds(POINTS)
