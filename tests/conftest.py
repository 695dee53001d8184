"""Settings and fixtures shared by all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Read when NumPy and torch are imported: on small matrices their threads wait more than they work.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The same examples on every run, and no time limits on shared machines. Beside the tests marked
# slow: pytest -m "" --hypothesis-profile=thorough
settings.register_profile("default", derandomize=True, deadline=None, max_examples=20)
settings.register_profile("thorough", settings.get_profile("default"), max_examples=200)
settings.load_profile("default")


@pytest.fixture
def quick(tmp_path: Path) -> str:
    """Path of a scene so short that a simulation costs next to nothing."""
    path = tmp_path / "quick.yaml"
    path.write_text("sequence: [NSNS, SN-N]\nmount: free\nduration: 0.05\n", encoding="utf-8")
    return str(path)
