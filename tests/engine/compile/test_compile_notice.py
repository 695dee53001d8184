"""Tests of notices about long compilations of this package's kernels."""

import logging
import signal
from types import SimpleNamespace
from typing import Any

import pytest

from magfold_env.engine.compile import compile_notice
from magfold_env.engine.compile.compile_notice import CompileNotice


def event_of(function: Any) -> SimpleNamespace:
    return SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=function)})


def a_function(name: str, module: str | None = "magfold_env.engine.chain") -> Any:
    return type(name, (), {"__module__": module})


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(time=0.0)
    monkeypatch.setattr(compile_notice.time, "monotonic", lambda: now.time)
    return now


def compile_for(seconds: float, listener: CompileNotice, clock: SimpleNamespace) -> None:
    """Compile a function that calls two others, each of which takes half the time."""
    solve = event_of(a_function("solve"))
    listener.on_start(solve)
    for _ in range(2):
        clock.time += seconds / 2.0
        called = a_function("called")
        for _ in range(2):
            listener.on_start(event_of(called))
            listener.on_end(event_of(called))
    listener.on_end(solve)


def test_what_takes_long_is_named_counted_and_timed(clock, caplog):
    finished: list[bool] = []
    listener = CompileNotice(lambda: finished.append(True), range(20))
    with caplog.at_level(logging.WARNING, "magfold_env"):
        listener.on_start(event_of(a_function("another", None)))
        clock.time += 40.0
        listener.on_end(event_of(a_function("another", None)))
        compile_for(0.5, listener, clock)
        assert not caplog.messages
        compile_for(40.0, listener, clock)
        compile_for(40.0, listener, clock)
    first, done, again, done_again = caplog.messages
    name = "magfold_env.engine.chain.solve"
    assert first.startswith(f"compiling {name} for its first use, kernel 5 of up to 20; ")
    assert "magfold warmup" in first
    assert again == f"compiling {name} for its first use, kernel 8 of up to 20"
    assert done == done_again == f"compiled {name} in 40 s"
    assert len(finished) == 3


@pytest.mark.parametrize("within", [True, False])
def test_ctrl_c_is_not_lost_in_a_callback_that_swallows_it(within):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    solve, listener = event_of(a_function("solve")), CompileNotice(lambda: None)
    try:
        listener.on_start(solve)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            (listener.on_start if within else listener.on_end)(solve)
        if within:
            listener.on_end(solve)
        assert listener.compiling_since is None
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
