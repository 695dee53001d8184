import statistics
import subprocess
import sys

PACKAGE = "magfold_env"
DEPENDENCIES = "gymnasium, numba, pydantic"

CODE = """
import sys, time
begun = time.process_time()
import {modules}
seconds = time.process_time() - begun
heavy = {{"torch", "stable_baselines3", "pygame", "matplotlib", "moviepy"}} & set(sys.modules)
print(seconds, *sorted(heavy))
"""


def _imported(modules: str) -> tuple[float, list[str]]:
    """Return the processor time [s] that importing takes, and what of the heavy came with it."""
    code = CODE.format(modules=modules)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    seconds, *heavy = run.stdout.split()
    return float(seconds), heavy


def test_importing_the_package_pulls_in_nothing_heavy() -> None:
    assert _imported(PACKAGE)[1] == []


def test_importing_the_package_is_quick() -> None:
    # A ratio, for a busy machine is not the package's fault; it is about 2. The first import may
    # compile.
    _imported(PACKAGE)
    pairs = [(_imported(PACKAGE)[0], _imported(DEPENDENCIES)[0]) for _ in range(3)]
    assert statistics.median(ours / theirs for ours, theirs in pairs) < 4.0
