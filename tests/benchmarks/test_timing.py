"""Tests of the timing helper on work of known duration."""

import pytest

from magfold_bench.timing import ratio, take_turns


class Clock:
    """A clock that only work advances, at a speed that changes from round to round."""

    def __init__(self):
        self.now = 0.0
        self.speed = 1.0
        self.log = []

    def __call__(self):
        return self.now

    def task(self, name, seconds, preparation=0.0):
        def prepare():
            self.now += preparation

            def call():
                self.now += seconds / self.speed
                self.log.append(name)

            return call

        return prepare


def test_tasks_take_turns_and_ratios_are_free_of_drift_and_preparation() -> None:
    clock = Clock()

    def drift(share):
        clock.speed = 1.0 + 3.0 * share

    tasks = {"slow": clock.task("slow", 0.5, 7.0), "fast": clock.task("fast", 0.1, 0.3)}
    times = take_turns(tasks, rounds=5, shortest=0.0, clock=clock, tick=drift)
    assert times["slow"].samples[0] == pytest.approx(0.5)
    assert times["slow"].samples[-1] < 0.2  # the machine became faster
    quotient = ratio(times["slow"], times["fast"])
    assert (quotient.low, quotient.median, quotient.high) == pytest.approx((5.0, 5.0, 5.0))
    clock = Clock()
    tasks = {"long": clock.task("long", 1.0), "short": clock.task("short", 0.3)}
    times = take_turns(tasks, rounds=2, shortest=1.0, clock=clock)
    warm_up = ["long"] * 2 + ["short"] * 2
    assert clock.log == [*warm_up, *(["long"] + ["short"] * 4) * 2]
    assert times["short"].median == pytest.approx(0.3)  # a call, not a sample
