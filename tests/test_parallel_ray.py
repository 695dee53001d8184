"""Tests of ensembles and designs on a Ray cluster of two nodes that loses workers and nodes."""

import importlib
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import magfold_env as mf
from magfold_env.ensembles.releases import release
from magfold_env.parallel import Workers, finished

# Ray leaves sockets and files to be closed by the collector.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]

SCENE = release(
    mf.load_scene("paper/sequence-1").replace(
        spreads=mf.Spreads(friction=0.3, feed_speed=0.3, feed_jitter=0.2, magnet=0.1)
    ),
    "backward",
    speed=0.1,
)
RUNS = 300


def node_of(_: int) -> str:
    context: Any = importlib.import_module("ray").get_runtime_context()
    return context.get_node_id()


def bits(made: mf.Ensemble) -> tuple[bytes, ...]:
    return tuple(column.tobytes() for column in made.columns().values())


def workers_of(node: Any) -> list[int]:
    """Return the processes of a node that work for joblib's pool."""
    raylet = node.all_processes["raylet"][0].process.pid
    found: list[int] = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            title = (folder / "cmdline").read_text()
        except OSError:  # it has just ended
            continue
        if parent == raylet and title.startswith("ray::PoolActor"):
            found.append(int(folder.name))
    return found


def kill_a_worker(cluster: Any) -> None:
    (node,) = cluster.worker_nodes
    worker, *_ = workers_of(node)
    os.kill(worker, signal.SIGKILL)


def lose_a_node(cluster: Any) -> None:
    (node,) = cluster.worker_nodes
    cluster.remove_node(node, allow_graceful=False)


@pytest.mark.usefixtures("cluster")
def test_both_nodes_work() -> None:
    nodes = {node for _, node in finished(node_of, range(40), Workers(2, "ray"))}
    assert len(nodes) == 2


@pytest.mark.usefixtures("cluster")
def test_a_cluster_makes_the_runs_that_threads_make() -> None:
    alone = mf.ensemble(SCENE, RUNS, seed=3, workers=1)
    spread = mf.ensemble(SCENE, RUNS, seed=3, backend="ray")
    assert bits(spread) == bits(alone)


class Soon:
    """A progress function that loses part of the cluster shortly after its n-th call."""

    def __init__(self, lose: Callable[[Any], None], cluster: Any, after: int) -> None:
        self._timer = threading.Timer(0.2, lambda: self.done.append(lose(cluster)))
        self._left = after
        self.done: list[None] = []

    def __call__(self, *_: Any) -> None:
        self._left -= 1
        if self._left == 0:
            self._timer.start()


@pytest.mark.parametrize("lose", [kill_a_worker, lose_a_node])
def test_runs_of_what_is_lost_are_made_again(lose: Any, cluster: Any) -> None:
    soon = Soon(lose, cluster, after=10)
    spread = mf.ensemble(SCENE, RUNS, seed=3, backend="ray", progress=soon)
    assert soon.done
    assert bits(spread) == bits(mf.ensemble(SCENE, RUNS, seed=3, workers=1))
