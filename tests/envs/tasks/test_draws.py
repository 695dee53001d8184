import hashlib

import gymnasium
import pytest

from agents.settings import MAX_TRAINING_SEED
from magfold_env.envs.tasks.draws import EVALUATION_VERSION, episode_seeds, evaluation_seeds

DIGESTS = {1: "c5e684622af210ee"}
"""Of what the seeds of each version lead to. A new one is written down with a new version."""


def test_the_draws_of_a_version_stay_what_they_are() -> None:
    digest = hashlib.sha256()
    for env_id in ("MagFold/TubeFeed-v0", "MagFold/SequenceDesign-v0"):
        for randomisation in ("nominal", "strong"):
            env = gymnasium.make(env_id, randomisation=randomisation, baseline=None).unwrapped
            for seed in evaluation_seeds(5):
                _, info = env.reset(seed=seed)
                drawn = env.episodes.scene(0)  # pyright: ignore[reportAttributeAccessIssue]
                digest.update(info["target"].encode())
                values = (drawn.friction, drawn.magnets.remanence, *drawn.start_angles)
                digest.update(" ".join(f"{value:.12e}" for value in values).encode())
    assert digest.hexdigest()[:16] == DIGESTS[EVALUATION_VERSION]


def test_longer_lists_begin_with_shorter_ones() -> None:
    assert evaluation_seeds(20)[:5] == evaluation_seeds(5)
    assert len(set(evaluation_seeds(200))) == 200


def test_streams_and_training_seeds_do_not_meet() -> None:
    streams = [set(episode_seeds(name, 100)) for name in ("evaluation", "validation", "tuning")]
    assert len(set.union(*streams)) == 300
    # Training seeds its environments with its own seed plus their number.
    assert min(map(min, streams)) > 2 * MAX_TRAINING_SEED


def test_another_version_is_named() -> None:
    with pytest.raises(ValueError, match="version: 2 is not allowed; must be 1"):
        evaluation_seeds(1, version=2)
