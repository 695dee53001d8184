"""The scripts of `.ci/`: what they tell of their steps."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]

STEPS = """
set -euo pipefail
source .ci/steps
name=nightly root=$1
step 1 "what passes" true
step 1 "what fails" sh -c "exit 3"
step 0.005 "what takes too long" sleep 30
step 1 "what comes last" true
finish
"""


def test_a_step_that_fails_keeps_none_from_being_taken_and_is_told(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    command = ["bash", "-c", STEPS, "nightly", str(tmp_path)]
    assert subprocess.run(command, cwd=ROOT, check=False, capture_output=True).returncode == 1
    page = (tmp_path / "docs" / "nightly.md").read_text(encoding="utf-8")
    assert page.splitlines()[-4:] == [
        "| what passes | passed | 0 min |",
        "| what fails | **failed** with 3 | 0 min |",
        "| what takes too long | **not done** within 0.005 min | 0 min |",
        "| what comes last | passed | 0 min |",
    ]
    assert [path.name for path in (tmp_path / "docs").iterdir()] == ["nightly.md"]
