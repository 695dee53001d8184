"""Parallel calls of one function through joblib, on threads, processes or a Ray cluster."""

import importlib
import os
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any, Literal, TypeVar, get_args

from magfold_env.files import pip_install
from magfold_env.scene import Problem, errors

Backend = Literal["threads", "processes", "ray"]

T = TypeVar("T")
R = TypeVar("R")
Calls = list[tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]]

MOST_WORKERS = 4096
"""Largest number of workers; a larger number is probably a typing error."""

LOSSES = 3
"""Number of consecutive losses of workers, with no result in between, that end the work."""

_FEW_THREADS, _MANY_TASKS = 4, 500

_WAVE = 2.0
"""Target time of a batch of tasks on a cluster [s]."""


def threads_of(threads: int | None) -> int:
    """Return the number of threads to use; None means one per core that the process may use."""
    if threads is None:
        usable = getattr(os, "sched_getaffinity", None)
        return len(usable(0)) if usable else os.cpu_count() or 1
    errors.refuse(errors.unless_whole("threads", threads, 1, MOST_WORKERS))
    return threads


@dataclass(frozen=True)
class Workers:
    """The number and the kind of workers. Values that are not allowed raise a SceneError."""

    count: int | None = None
    """Number of parallel workers; None uses all cores, or all CPUs of a cluster."""
    backend: Backend | None = None
    """Threads of this process, processes on this machine, or a Ray cluster: the one at
    ``RAY_ADDRESS``, else a local one.

    None selects processes for more than four workers on at least 500 tasks, else threads. Only one
    thread runs at a time outside the kernels, which take three quarters of a short release.
    Processes take seconds to start.
    """

    def __post_init__(self) -> None:
        problems: list[Problem] = []
        if self.count is not None:
            problems += errors.unless_whole("workers", self.count, 1, MOST_WORKERS)
        if self.backend is not None:
            problems += errors.unless_one_of("backend", self.backend, get_args(Backend))
        errors.refuse(problems)

    def kind(self, tasks: int) -> Backend:
        """Return the backend for this number of tasks."""
        if self.backend is not None:
            return self.backend
        few = tasks < _MANY_TASKS or (self.count or os.cpu_count() or 1) <= _FEW_THREADS
        return "threads" if few else "processes"


def finished(
    function: Callable[[T], R], tasks: Sequence[T], workers: Workers
) -> Generator[tuple[int, R]]:
    """Yield the index and the result of every task, in the order of completion.

    The result of ``function`` must depend only on its task. The function must be picklable unless
    it runs on threads. If it raises an error, the work ends. Tasks of a lost worker run again;
    `LOSSES` losses in a row without a result raise a RuntimeError.
    """
    left = dict(enumerate(tasks))
    backend = workers.kind(len(left))
    # Processes start after the first task has written compiled kernels to the cache on disk.
    alone = len(left) if workers.count == 1 and backend != "ray" else 0
    if backend == "processes":
        alone = max(alone, 1)
    for place in list(left)[:alone]:
        yield place, function(left.pop(place))
    if not left:
        return
    losses = 0
    with _pool(backend, workers) as (run, lost):
        while left:
            calls: Calls = [(_numbered, (function, *item), {}) for item in left.items()]
            try:
                for place, result in run(calls):
                    del left[place]
                    losses = 0
                    yield place, result
            except lost as error:
                losses += 1
                if losses == LOSSES:
                    message = f"workers were lost {LOSSES} times in a row: {error}"
                    raise RuntimeError(message) from error


@contextmanager
def connected(workers: Workers) -> Generator[None]:
    """Stay connected to a Ray cluster between calls of `finished`."""
    if workers.backend != "ray":
        yield
        return
    with _ray():
        yield


Runner = Callable[[Calls], Iterable[tuple[int, Any]]]
Errors = tuple[type[Exception], ...]


def _numbered(function: Callable[[Any], Any], place: int, task: object) -> tuple[int, Any]:
    return place, function(task)


@contextmanager
def _pool(backend: Backend, workers: Workers) -> Generator[tuple[Runner, Errors]]:
    """Yield a function that runs calls, and the errors that mean a lost worker."""
    joblib: Any = importlib.import_module("joblib")  # slow to import
    count = -1 if workers.count is None else workers.count
    if backend == "ray":

        def waves(calls: Calls) -> Iterable[tuple[int, Any]]:
            # CPUs are counted every time, because the cluster may have lost or gained a node.
            cpus = joblib.effective_n_jobs(-1)
            size = min(workers.count or cpus, cpus)
            return _in_waves(joblib.Parallel(size), calls, 2 * size)

        with _ray() as (options, lost), joblib.parallel_config("ray", **options):
            yield waves, lost
        return
    name = {"threads": "threading", "processes": "loky"}[backend]
    broken: Any = importlib.import_module("concurrent.futures.process")

    def streamed(calls: Calls) -> Iterable[tuple[int, Any]]:
        # Each call needs a new pool, because results may still reach a pool that lost a worker.
        parallel = joblib.Parallel(count, backend=name, return_as="generator_unordered")
        return without_warning(parallel(calls))

    yield streamed, (broken.BrokenProcessPool,)


@contextmanager
def _ray() -> Generator[tuple[dict[str, Any], Errors]]:
    """Yield joblib's Ray backend: its options, and its errors for a lost worker."""
    try:
        ray: Any = importlib.import_module("ray")
        backend: Any = importlib.import_module("ray.util.joblib")
    except ImportError as error:
        message = f"backend 'ray' needs Ray: install the extra, {pip_install('ray')}"
        raise ImportError(message) from error
    backend.register_ray()
    started = not ray.is_initialized()
    if started:
        ray.init(logging_level="warning", log_to_driver=False)
    try:
        # Ray restarts a lost worker, on another node if needed, and repeats its tasks. Workers that
        # claim no CPU crowd on one node, and workers that claim a whole CPU cannot move to another
        # node. Ray fills a node to one half before it uses the next, so claims of half a CPU give
        # each node one worker per CPU.
        again = {"num_cpus": 0.5, "max_restarts": LOSSES, "max_task_retries": LOSSES}
        yield {"ray_remote_args": again}, (ray.exceptions.RayError,)
    finally:
        if started:
            ray.shutdown()


def without_warning(results: Generator[T]) -> Generator[T]:
    """Yield joblib's results without its warning that an early end loses results."""
    try:
        for result in results:  # noqa: UP028 - "yield from" would close the results itself, and warn
            yield result
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            results.close()


def _in_waves(parallel: Any, calls: Calls, least: int) -> Generator[tuple[int, Any]]:
    """Run calls in batches of about `_WAVE`, because Ray's backend returns complete batches."""
    rest, size = iter(calls), least
    with parallel:
        while wave := list(islice(rest, size)):
            begun = time.perf_counter()
            yield from parallel(wave)
            taken = time.perf_counter() - begun
            size = max(least, min(4 * size, round(size * _WAVE / max(taken, 1e-6))))
