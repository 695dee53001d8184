"""Word of a long compilation: once, and only for kernels of this package."""

import logging
from types import SimpleNamespace

import pytest

from magfold_env.engine.compile import first_use
from magfold_env.engine.compile.first_use import FirstUse


def begun(module: str) -> SimpleNamespace:
    function = SimpleNamespace(__module__=module)
    return SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=function)})


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(time=0.0)
    monkeypatch.setattr(first_use.time, "monotonic", lambda: now.time)
    return now


def compile_for(listener: FirstUse, clock: SimpleNamespace, seconds: float, module: str) -> None:
    """Compile a function that calls two others, each of which takes half the time."""
    event = begun(module)
    listener.on_start(event)
    for _ in range(2):
        clock.time += seconds / 2.0
        listener.on_start(event)
        listener.on_end(event)
    listener.on_end(event)


def test_it_is_said_once_when_it_takes_long(clock, caplog):
    finished: list[bool] = []
    listener = FirstUse(lambda: finished.append(True))
    with caplog.at_level(logging.WARNING, "magfold_env"):
        compile_for(listener, clock, 0.5, "magfold_env.engine.chain.articulated")
        assert not caplog.messages
        compile_for(listener, clock, 40.0, "magfold_env.engine.chain.articulated")
        compile_for(listener, clock, 40.0, "magfold_env.engine.chain.articulated")
    (message,) = caplog.messages
    assert "first use" in message
    assert len(finished) == 3


def test_functions_of_others_are_not_spoken_of(clock, caplog):
    compile_for(FirstUse(lambda: None), clock, 40.0, "other.module")
    assert not caplog.messages


def test_worker_processes_keep_quiet(clock, caplog, monkeypatch):
    monkeypatch.setattr(first_use.multiprocessing, "parent_process", object)
    compile_for(FirstUse(lambda: None), clock, 40.0, "magfold_env.engine.chain.articulated")
    assert not caplog.messages
