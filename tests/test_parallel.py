"""Tests of parallel calls: each result arrives once, on any backend and after any loss."""

import os
import sys
import threading
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from joblib.parallel import ThreadingBackend, register_parallel_backend

from magfold_env import parallel
from magfold_env.parallel import LOSSES, Workers, finished


def square(x: int) -> int:
    return x * x


def die_once(task: tuple[int, str]) -> int:
    """End the process at task 3, but only the first time."""
    x, flag = task
    if x == 3 and not Path(flag).exists():
        Path(flag).touch()
        os._exit(1)
    return x * x


def die_elsewhere(home: int) -> int:
    if os.getpid() != home:
        os._exit(1)
    return home


def fail_at_three(x: int) -> int:
    if x == 3:
        raise ZeroDivisionError("three")
    return x


@pytest.mark.parametrize(
    "workers", [Workers(1), Workers(3), Workers(2, "processes"), Workers(1, "processes")]
)
@pytest.mark.parametrize("count", [0, 1, 20])
def test_every_task_is_done_once(workers: Workers, count: int) -> None:
    found = list(finished(square, range(count), workers))
    assert sorted(found) == [(k, k * k) for k in range(count)]


def test_threads_work_at_the_same_time() -> None:
    both = threading.Barrier(2, timeout=600.0)  # reached only where they do not
    assert len(list(finished(lambda _: both.wait(), range(2), Workers(2)))) == 2


@pytest.mark.parametrize(
    "workers",
    [Workers(1), Workers(2), pytest.param(Workers(2, "processes"), marks=pytest.mark.slow)],
)
def test_an_error_of_a_task_is_raised(workers: Workers) -> None:
    with pytest.raises(ZeroDivisionError, match="three"):
        list(finished(fail_at_three, range(6), workers))


@pytest.mark.medium
def test_tasks_of_a_lost_process_are_run_again(tmp_path: Path) -> None:
    tasks = [(x, str(tmp_path / "died")) for x in range(12)]
    found = list(finished(die_once, tasks, Workers(2, "processes")))
    assert (tmp_path / "died").exists()
    assert sorted(found) == [(k, k * k) for k in range(12)]


@pytest.mark.medium
def test_processes_that_die_again_and_again_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "LOSSES", 2)  # new processes take seconds
    found = finished(die_elsewhere, [os.getpid()] * 4, Workers(2, "processes"))
    assert next(found) == (0, os.getpid())
    with pytest.raises(RuntimeError, match="workers were lost 2 times in a row"):
        list(found)


def test_what_is_broken_off_warns_of_nothing() -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        results = finished(abs, range(20), Workers(2, "threads"))
        next(results)
        time.sleep(0.1)  # others are done as well
        results.close()
    assert not told


# --- Ray ---------------------------------------------------------------------------------------


class LostError(Exception):
    """A substitute for Ray's errors."""


def fake_ray(monkeypatch: pytest.MonkeyPatch, running: bool = False) -> list[Any]:
    """Replace Ray by threads that can be lost; return the calls that were made."""
    calls: list[Any] = ["init"] if running else []

    def backend(*, ray_remote_args: dict[str, Any], **options: Any) -> Any:
        calls.append(ray_remote_args)
        return ThreadingBackend(**options)

    ray = {"is_initialized": lambda: "init" in calls, "init": lambda **_: calls.append("init")}
    ray |= {"shutdown": lambda: calls.append("shutdown")}
    ray["exceptions"] = SimpleNamespace(RayError=LostError)
    joblib = {"register_ray": lambda: register_parallel_backend("ray", backend)}
    for name, content in {"ray": ray, "ray.util": {}, "ray.util.joblib": joblib}.items():
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(**content))
    return calls


def lose(times: int) -> Callable[[int], int]:
    """Return a function that loses its worker a number of times."""
    left = iter(range(times))

    def work(x: int) -> int:
        if next(left, None) is not None:
            raise LostError("a node is gone")
        return x * x

    return work


@pytest.mark.parametrize("running", [True, False])
def test_ray_is_started_where_it_is_not_running(running, monkeypatch):
    calls = fake_ray(monkeypatch, running)
    found = list(finished(square, range(50), Workers(2, "ray")))
    assert sorted(found) == [(k, k * k) for k in range(50)]
    again = {"num_cpus": 0.5, "max_restarts": LOSSES, "max_task_retries": LOSSES}
    assert calls == ["init", again, *([] if running else ["shutdown"])]


def test_tasks_of_a_lost_node_are_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    fake_ray(monkeypatch)
    found = list(finished(lose(LOSSES - 1), range(9), Workers(1, "ray")))
    assert sorted(found) == [(k, k * k) for k in range(9)]
    with pytest.raises(RuntimeError, match="a node is gone"):
        list(finished(lose(LOSSES), range(9), Workers(1, "ray")))


def test_without_ray_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ImportError, match=r"install the extra, pip install -e '\.\[ray\]'"):
        list(finished(square, range(2), Workers(2, "ray")))
