"""Tests that a scene gives identical folds on any thread and for any number of threads."""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from magfold_bench.laws.random_scenes import random_scene
from magfold_env.simulation.simulate import simulate
from tests.command_line import python

pytestmark = pytest.mark.laws

SEEDS = (0, 3, 10, 16, 18, 21)


def fingerprint(seed: int) -> str:
    """Return a hash of all bits of a random scene's end, and of the work."""
    fold = simulate(random_scene(seed))
    data = fold.angles.tobytes() + fold.base.tobytes()
    return hashlib.sha256(data + f"{fold.time!r} {fold.steps} {fold.message}".encode()).hexdigest()


@pytest.fixture(scope="module")
def alone() -> list[str]:
    return [fingerprint(seed) for seed in SEEDS]


def test_threads_side_by_side_change_no_bit(alone):
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(fingerprint, SEEDS * 3))
    assert together == alone * 3


@pytest.mark.parametrize("threads", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_the_number_of_threads_changes_no_bit(alone, threads):
    # A process may have compiled other kernels before; this one has not.
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    code = f"from {__name__} import SEEDS, fingerprint; print(*map(fingerprint, SEEDS))"
    run = python("-c", code, cwd=Path(__file__).parents[2], **dict.fromkeys(names, str(threads)))
    assert run.stdout.split() == alone
