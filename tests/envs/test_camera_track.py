"""Tests of every track with a given chain, in which actions choose only the feed speed."""

from typing import Any

import numpy as np
import pytest

from magfold_env.envs.camera_track import FeedTrackEnv, replay
from magfold_env.envs.lumen import LumenEnv
from magfold_env.envs.unknown_floor import UnknownFloorEnv

both_tracks = pytest.mark.parametrize("make", [UnknownFloorEnv, LumenEnv])


@pytest.mark.parametrize("actions", ["box", "discrete"])
@both_tracks
def test_episodes_replay_bit_for_bit(make: type[FeedTrackEnv], actions: Any) -> None:
    env = make(actions=actions)
    env.action_space.seed(1)
    for seed in range(4):
        env.reset(seed=seed)
        ended = False
        while not ended:
            *_, ended, _, _ = env.step(env.action_space.sample())
        again = replay(env.to_scene(), env.history).arrays
        np.testing.assert_array_equal(again.angles[0], env.state.angles)
        np.testing.assert_array_equal(again.base[0], env.state.base)
        np.testing.assert_array_equal(again.released[0], env.episodes.arrays.released[0])


@both_tracks
def test_an_observation_tells_nothing_of_what_is_drawn(make: type[FeedTrackEnv]) -> None:
    """Before a component is outside, observations of two draws differ only in the force's noise."""
    env = make()
    first = [env.reset(seed=seed, options={"task": 3})[0] for seed in (0, 1)]
    force = env.layout.slices["force"]
    for observation in first:
        assert observation[force] != 0.0
        observation[force] = 0.0
    np.testing.assert_array_equal(first[0], first[1])
