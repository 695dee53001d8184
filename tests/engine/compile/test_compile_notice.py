"""Word of long compilations, of kernels of this package only."""

import logging
import signal
from types import SimpleNamespace

import pytest

from magfold_env.engine.compile import compile_notice
from magfold_env.engine.compile.compile_notice import CompileNotice


class Kernel:
    """As much of a kernel as is looked at."""

    def __init__(self, module: str | None, name: str) -> None:
        self.py_func = type(name, (), {"__module__": module})


def begun(kernel: Kernel) -> SimpleNamespace:
    return SimpleNamespace(data={"dispatcher": kernel})


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(time=0.0)
    monkeypatch.setattr(compile_notice.time, "monotonic", lambda: now.time)
    return now


def compile_for(
    listener: CompileNotice, clock: SimpleNamespace, seconds: float, module: str | None
) -> None:
    """Compile a function that calls two others, each of which takes half the time, by parts."""
    event = begun(Kernel(module, "solve"))
    listener.on_start(event)
    for _ in range(2):
        clock.time += seconds / 2.0
        called = Kernel(module, "called")
        within = Kernel(module, "called")
        within.py_func = called.py_func
        for dispatcher in (called, within):
            listener.on_start(begun(dispatcher))
            listener.on_end(begun(dispatcher))
    listener.on_end(event)


def test_what_takes_long_is_named_counted_and_timed(clock, caplog):
    finished: list[bool] = []
    listener = CompileNotice(lambda: finished.append(True), range(20))
    with caplog.at_level(logging.WARNING, "magfold_env"):
        compile_for(listener, clock, 0.5, "magfold_env.engine.chain.articulated")
        assert not caplog.messages
        compile_for(listener, clock, 40.0, "magfold_env.engine.chain.articulated")
        compile_for(listener, clock, 40.0, "magfold_env.engine.chain.articulated")
    name = "magfold_env.engine.chain.articulated.solve"
    first, done, again, done_again = caplog.messages
    assert first.startswith(f"compiling {name} for its first use, kernel 5 of up to 20; ")
    assert "magfold warmup" in first
    assert again == f"compiling {name} for its first use, kernel 8 of up to 20"
    assert done == done_again == f"compiled {name} in 40 s"
    assert len(finished) == 3


@pytest.fixture
def usual_interrupts():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("usual_interrupts")
def test_ctrl_c_is_not_lost_in_a_callback_that_swallows_it():
    kernel, listener = begun(Kernel("magfold_env.engine", "solve")), CompileNotice(lambda: None)
    for within in (True, False):
        listener.on_start(kernel)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        if within:
            with pytest.raises(KeyboardInterrupt):
                listener.on_start(begun(Kernel("magfold_env.engine", "called")))
            listener.on_end(kernel)
        else:
            with pytest.raises(KeyboardInterrupt):
                listener.on_end(kernel)
        assert listener.compiling_since is None
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
