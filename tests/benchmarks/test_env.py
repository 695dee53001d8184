"""The environments' benchmark: who plays what, what counts as Python's share, and the report."""

import gymnasium
import numpy as np

from magfold_bench.episodes import log_uniform, play_single, play_vector, single, vector

OPTIONS = {"fidelity": "quasistatic", "actions": "box"}


class Diary(gymnasium.Wrapper):
    """Notes how every episode went."""

    def __init__(self, env):
        super().__init__(env)
        self.episodes = []

    def reset(self, **given):
        self.episodes.append([])
        return self.env.reset(**given)

    def step(self, action):
        result = self.env.step(action)
        self.episodes[-1].append(result[0])
        return result


def test_alone_and_side_by_side_the_same_episodes_are_played(monkeypatch):
    actions = log_uniform(np.random.default_rng(1), 6, 4)
    alone = Diary(single(**OPTIONS))
    play_single(alone, 7, actions)
    together = vector(4, fidelity="quasistatic", actions="box")
    seen, step = [], together.step

    def noted(given):
        seen.append(step(given)[0].copy())

    monkeypatch.setattr(together, "step", noted)
    play_vector(together, 7, actions)
    assert len(seen) == 6
    for k, episode in enumerate(alone.episodes):
        # The last observation of a vector is already the next episode's.
        for mine, theirs in zip(episode[:-1], seen, strict=False):
            np.testing.assert_array_equal(mine, theirs[k])
