import subprocess
import sys

import pytest

PACKAGE = "magfold_env"
DEPENDENCIES = "gymnasium, numba, pydantic"

CODE = """
import sys, time
begun = time.process_time()
import {modules}
seconds = time.process_time() - begun
heavy = "torch stable_baselines3 pygame matplotlib moviepy PIL joblib ray scipy.stats".split()
print(seconds, *(name for name in heavy if name in sys.modules))
"""


def _imported(modules: str) -> tuple[float, list[str]]:
    """Return the processor time [s] that importing takes, and what of the heavy came with it."""
    code = CODE.format(modules=modules)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    seconds, *heavy = run.stdout.split()
    return float(seconds), heavy


@pytest.fixture(scope="module")
def first() -> tuple[float, list[str]]:
    """What the first import gave, which may compile."""
    return _imported(PACKAGE)


def test_importing_the_package_pulls_in_nothing_heavy(first: tuple[float, list[str]]) -> None:
    assert first[1] == []


@pytest.mark.usefixtures("first")
def test_importing_the_package_is_quick() -> None:
    # A ratio, for a busy machine is not the package's fault; it is about 2.
    ours, theirs = (
        min(_imported(modules)[0] for _ in range(2)) for modules in (PACKAGE, DEPENDENCIES)
    )
    assert ours < 4.0 * theirs
