import hashlib
from typing import Any

import gymnasium
import numpy as np
import pytest

from agents.settings import MAX_TRAINING_SEED
from magfold_env.envs.tasks.draws import (
    EVALUATION_VERSION,
    episode_seeds,
    evaluation_seeds,
    randomised,
)
from magfold_env.scene import SceneError, load_scene
from magfold_env.scoring.track import TRAYS

DIGESTS = {
    "MagFold/UnknownFloor-v0": "fbcf76e53af37b64", "MagFold/Reprogram-v0": "da33774a6efa1b6b",
    "MagFold/Lumen-v0": "c96c81ccc79e3770", "MagFold/Tray-v0": "5ff542abca81ab81",
    "MagFold/Anchor-v0": "0de0647fd8c3cca6",
}  # fmt: skip
"""Hashes of the draws of version 3. Different draws need another version."""


def test_the_draws_of_a_version_stay_what_they_are() -> None:
    digest = hashlib.sha256()
    for env_id in ("MagFold/TubeFeed-v0", "MagFold/SequenceDesign-v0"):
        for randomisation in ("nominal", "strong"):
            env = gymnasium.make(env_id, randomisation=randomisation, baseline=None).unwrapped
            for seed in evaluation_seeds(5):
                _, info = env.reset(seed=seed)
                drawn = env.episodes.scene(0)  # pyright: ignore[reportAttributeAccessIssue]
                digest.update(info["target"].encode())
                values = (drawn.friction, drawn.magnets.remanence, *drawn.start_offsets)
                digest.update(" ".join(f"{value:.12e}" for value in values).encode())
    assert (EVALUATION_VERSION, digest.hexdigest()[:16]) == (3, "aaa54c1b745ad2dd")


def written(value: Any) -> str:
    """Return the drawn values as text, with numbers to twelve digits."""
    if isinstance(value, dict):
        return " ".join(f"{key} {written(each)}" for key, each in sorted(value.items()))
    if isinstance(value, (list, tuple)):
        return " ".join(map(written, value))
    return f"{value:.11e}" if isinstance(value, float) else str(value)


@pytest.mark.parametrize("env_id", DIGESTS)
def test_so_do_those_of_a_track(env_id: str) -> None:
    env: Any = gymnasium.make(env_id).unwrapped
    digest = hashlib.sha256()
    for number, seed in enumerate(evaluation_seeds(6)):
        env.reset(seed=seed, options={"task": number % len(env.tasks)})
        digest.update(written(env.tasks[number % len(env.tasks)].model_dump()).encode())
        # A spread that came after these versions; drawn scenes have none of it.
        drawn = env.episodes.scene(0).model_dump(exclude={"spreads": {"tilt"}})
        digest.update(written(drawn).encode())
        if env_id in TRAYS:
            digest.update(written(env.episodes.strengths[0].tolist()).encode())
    assert digest.hexdigest()[:16] == DIGESTS[env_id]


def test_longer_lists_begin_with_shorter_ones() -> None:
    assert evaluation_seeds(20)[:5] == evaluation_seeds(5)
    assert len(set(evaluation_seeds(200))) == 200


def test_streams_and_training_seeds_do_not_meet() -> None:
    streams = [set(episode_seeds(name, 100)) for name in ("evaluation", "validation", "tuning")]
    assert len(set.union(*streams)) == 300
    # Training seeds its environments with its own seed plus their number. That no seed of a stream
    # happens to be as small is not enough: none can be.
    assert min(map(min, streams)) >= 1 << 64 > 2 * MAX_TRAINING_SEED


def draws(randomisation: str, count: int = 200) -> list[Any]:
    scene = randomised(load_scene("tube-feed"), randomisation)  # pyright: ignore[reportArgumentType]
    rng = np.random.default_rng(0)
    return [scene.draw(rng) for _ in range(count)]


@pytest.mark.parametrize(
    ("randomisation", "friction", "remanence", "jitter", "angle"),
    [("nominal", 0.1, 0.05, 0.05, 0.03), ("strong", 0.3, 0.1, 0.2, 0.1)],
)
def test_presets_have_the_stated_widths(randomisation, friction, remanence, jitter, angle):
    mean = load_scene("tube-feed")
    magnets: Any = mean.magnets
    drawn = draws(randomisation)
    for values, width in (
        (np.array([scene.friction for scene in drawn]) / mean.friction - 1, friction),
        (np.array([scene.magnets.remanence for scene in drawn]) / magnets.remanence - 1, remanence),
        (np.array([scene.speeds for scene in drawn]) / mean.feed.speed - 1, jitter),
        (np.array([scene.start_offsets for scene in drawn]), angle * mean.casing.diagonal / 4),
    ):
        assert np.unique(values).size == values.size
        assert np.abs(values).max() <= width * (1 + 1e-12)
        assert values.min() < -0.9 * width
        assert values.max() > 0.9 * width


def test_spreads_of_the_scene_are_replaced_or_kept() -> None:
    plain, wide = (
        load_scene("tube-feed").replace(spreads=spreads)
        for spreads in ({}, {"mass": 0.1, "feed_jitter": 0.1, "magnet": 0.1})
    )
    for name in ("none", "nominal", "strong"):
        assert randomised(plain, name) == randomised(wide, name)
    assert randomised(wide, "scene") == wide
    one, other = (randomised(wide, "none").draw(np.random.default_rng(k)) for k in range(2))
    assert one == other
    assert not np.any(one.start_offsets)


@pytest.mark.parametrize(("changes", "message"), [
    ({"spreads": {"side": 0.01}}, r"spreads.side: 0.01 is not allowed; environments draw no"),
    ({"spreads": {"inset": 0.1}}, r"spreads.inset: 0.1 is not allowed; environments draw no"),
    ({"bumps": {"rate": 1.0, "speed": 0.1}}, r"bumps.seed: None is not allowed; environments"),
])  # fmt: skip
def test_what_episodes_do_not_draw_is_refused(changes: dict[str, Any], message: str) -> None:
    scene = load_scene("tube-feed").replace(**changes)
    with pytest.raises(SceneError, match=message):
        randomised(scene, "scene")
