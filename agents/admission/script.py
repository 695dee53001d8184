"""A script that knows no task: feed, look, draw a wrong fold back in, and feed again.

The script plays all tasks of a track with the same settings, which are selected from random ones on
training tasks (`agents.training.drawing_back`). It sees the joints exactly, without noise or delay,
so it is a strong opponent for policies that see a camera's frames.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from agents.open_loops.schedules import Schedule, constant
from agents.open_loops.search import RolloutPool, Search, halving, open_loops_of
from agents.training import drawing_back
from agents.training.drawing_back import Redoing, Refolding
from magfold_env.envs.baselines.constant_speed import SPEEDS
from magfold_env.envs.baselines.three_speeds import PULLS, PUSHES, push_pull_push
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.reprogram import ReprogramEnv
from magfold_env.scoring.track import WIDTH, Track

EFFORT = Search(192, 40_000)
"""Number of settings compared, and total number of episodes that compare them, for each track."""

Settings = Redoing | Refolding


def candidates(env: Any, count: int) -> Sequence[Settings]:
    """Return `count` random settings that feed at constant speeds, the fastest first."""
    if isinstance(env, ReprogramEnv):
        scene = env.setup.scene
        ways = (push_pull_push(scene, each) for each in product(PUSHES, PULLS, PUSHES))
        found = [Schedule("constant", way) for way in ways]
        return drawing_back.candidates_twice(found, 0, count, scene)
    return drawing_back.candidates([constant(each) for each in sorted(SPEEDS)[::-1]], 0, count)


def tuned(track: Track, effort: Search = EFFORT) -> int:
    """Return the place of the candidate that succeeds most often on a track's tasks and draws.

    The track must be on the side of training, and its stream must not be that of reported results.
    """
    pool = RolloutPool(track.episodes(WIDTH), open_loops_of(track.env))
    tried = candidates(track.env, effort.candidates)

    def trial(places: Ints, start: int, stop: int) -> Floats:
        numbers, seeds = track.draws(start, stop)
        found = [tried[place] for place in np.repeat(places, stop - start).tolist()]
        numbers, seeds = np.tile(numbers, len(places)), seeds * len(places)
        ends = pool.play(numbers, seeds, lambda part: drawing_back.playing(found[part]))
        return ends.reshape(len(places), stop - start, 2)

    return halving(len(tried), effort.budget, trial)[0].place
