"""How fast the machine is just now: the same fixed work, timed before and after every part.

A shared machine changes its pace, and times taken an hour apart compare only as far as it did not.
The work is a pendulum's swing (`whole.floor`): like the engine's kernels it is compiled arithmetic
on numbers that fit into the cache.
"""

from __future__ import annotations

from magfold_env.benchmarks.whole.floor import prepare_swing
from magfold_env.benchmarks.whole.skipping import variants
from magfold_env.reporting.timing import Spread, take_turns

ROUNDS = 9


def measure_pace() -> Spread:
    """Return what the fixed work takes [s]."""
    scene = variants()[-1].scene
    return take_turns({"swing": lambda: prepare_swing(scene)}, ROUNDS)["swing"].spread
