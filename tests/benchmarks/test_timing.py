"""The timing helper, on work whose length is known."""

import numpy as np
import pytest

from magfold_bench.timing import (
    Timing,
    enough_repeats,
    ratio,
    spread_of,
    take_turns,
)
from magfold_env.reporting import machine


class Clock:
    """Moves only when work is done, at a speed that changes from round to round."""

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


def test_ratios_are_free_of_drift_and_of_preparation():
    clock = Clock()

    def drift(share):
        clock.speed = 1.0 + 3.0 * share

    tasks = {"slow": clock.task("slow", 0.5, 7.0), "fast": clock.task("fast", 0.1, 0.3)}
    times = take_turns(tasks, rounds=5, shortest=0.0, clock=clock, tick=drift)
    assert times["slow"].samples[0] == pytest.approx(0.5)
    assert times["slow"].samples[-1] < 0.2  # the machine became faster
    quotient = ratio(times["slow"], times["fast"])
    assert (quotient.low, quotient.median, quotient.high) == pytest.approx((5.0, 5.0, 5.0))


def test_tasks_take_turns_and_short_ones_are_repeated():
    clock = Clock()
    tasks = {"long": clock.task("long", 1.0), "short": clock.task("short", 0.3)}
    times = take_turns(tasks, rounds=2, shortest=1.0, clock=clock)
    warm_up = ["long"] * 2 + ["short"] * 2
    assert clock.log == [*warm_up, *(["long"] + ["short"] * 4) * 2]
    assert times["short"].median == pytest.approx(0.3)  # a call, not a sample


def test_work_is_repeated_until_its_call_costs_nothing():
    clock = Clock()

    def work(repeats):
        clock.now += 0.5 + 0.1 * repeats

    repeats = enough_repeats(work, 10.0, clock)
    assert 0.5 + 0.1 * repeats >= 10.0 > 0.5 + 0.1 * repeats / 2


def test_spread_holds_median_and_quartiles():
    spread = spread_of(np.array([5.0, 1.0, 2.0, 4.0, 3.0]))
    assert (spread.low, spread.median, spread.high) == (2.0, 3.0, 4.0)
    with pytest.raises(ValueError, match="rounds"):
        ratio(Timing(np.ones(3)), Timing(np.ones(4)))


def test_the_machine_is_described():
    record = machine.describe()
    assert int(record["cores"]) >= 1
    assert all(record[name] for name in ("processor", "python", "numba", "commit"))
