import subprocess
import sys

CODE = """
import sys, time
begun = time.process_time()
import magfold_env
seconds = time.process_time() - begun
heavy = {"torch", "stable_baselines3", "pygame", "matplotlib", "moviepy"} & set(sys.modules)
print(seconds, *sorted(heavy))
"""


def test_importing_the_package_is_quick_and_pulls_in_nothing_heavy() -> None:
    # Processor time: a busy machine is not the package's fault. The first import may compile.
    runs = [
        subprocess.run([sys.executable, "-c", CODE], capture_output=True, check=True, text=True)
        for _ in range(2)
    ]
    seconds, *heavy = runs[-1].stdout.split()
    assert heavy == []
    assert float(seconds) < 1.0
