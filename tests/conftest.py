"""Settings and fixtures shared by all tests."""

import os
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# Read when NumPy and torch are imported: on small matrices their threads wait more than they work.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The same examples on every run, and no time limits on shared machines. Beside the tests marked
# slow: pytest -m "" --hypothesis-profile=thorough
settings.register_profile("default", derandomize=True, deadline=None, max_examples=20)
settings.register_profile("thorough", settings.get_profile("default"), max_examples=200)
settings.load_profile("default")


@pytest.fixture(scope="session", autouse=True)
def _no_folders_left_behind(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Make learners of Stable-Baselines3 log to a temporary folder unless they have their own."""
    os.environ.setdefault("SB3_LOGDIR", str(tmp_path_factory.getbasetemp() / "sb3"))


@pytest.fixture
def quick(tmp_path: Path) -> str:
    """Return the path of a scene whose simulation takes very little time."""
    path = tmp_path / "quick.yaml"
    path.write_text("sequence: [NSNS, SN-N]\nmount: free\nduration: 0.05\n", encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Generator[Any]:
    """Yield a tab of a headless Chromium."""
    from tests.replay import chromium  # noqa: PLC0415 - is not for all systems

    with chromium.page(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture(scope="module")
def head() -> Generator[Any]:
    """Yield a Ray cluster of one node with one CPU."""
    ray: Any = pytest.importorskip("ray.cluster_utils", reason="needs Ray, the extra ray")
    nodes = ray.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield nodes
    nodes.shutdown()


@pytest.fixture
def cluster(head: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a Ray cluster of two nodes with a CPU each, without any connection."""
    monkeypatch.setenv("RAY_ADDRESS", head.address)
    if not head.worker_nodes:
        head.add_node(num_cpus=1)
        head.wait_for_nodes()
    return head
