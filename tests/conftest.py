"""Settings and fixtures shared by all tests."""

from pathlib import Path

import pytest
from hypothesis import settings

# The same examples on every run, and no time limits on shared machines.
settings.register_profile("default", derandomize=True, deadline=None, max_examples=60)
settings.load_profile("default")


@pytest.fixture
def quick(tmp_path: Path) -> str:
    """Path of a scene so short that a simulation costs next to nothing."""
    path = tmp_path / "quick.yaml"
    path.write_text("sequence: [NSNS, SN-N]\nmount: free\nduration: 0.05\n", encoding="utf-8")
    return str(path)
