"""Tests of environments that choose magnets, one component at a time or all at once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.sequence_design import SequenceDesignEnv
from magfold_env.envs.tasks.goals import goal_words
from magfold_env.envs.tube_feed import TubeFeedEnv
from tests.envs import contract


def play(env: Any, seed: int, target: str | None = None) -> tuple[list, dict]:
    """Play random actions that depend on `seed` alone; return rewards and the last info."""
    said = contract.play(env, seed, {"target": target} if target else None)
    return [each[1] for each in said[1:]], said[-1][-1]


BACKWARD = mf.load_scene("tube-feed").replace(feed={"direction": "backward"})


@pytest.mark.parametrize(("make", "scene"), [
    (TubeFeedEnv, "tube-feed"),
    (TubeFeedEnv, BACKWARD),
    (SequenceDesignEnv, "tube-built"),
    (SequenceDesignEnv, "tube-feed"),
])  # fmt: skip
@pytest.mark.parametrize("seed", range(4))
def test_an_episode_replays_bit_for_bit(make: Any, scene: Any, seed: int, tmp_path: Path) -> None:
    env = make(scene, baseline=None)
    _, info = play(env, seed)
    mf.save_scene(env.to_scene(), tmp_path / "episode.yaml")
    replay = mf.load_scene(tmp_path / "episode.yaml")
    assert replay == env.to_scene()
    assert replay.is_concrete
    fold = mf.simulate(replay, seed=12345)  # nothing is left for the seed to decide
    end = env.state
    np.testing.assert_array_equal(fold.angles, end.angles)
    np.testing.assert_array_equal(fold.base, end.base)
    assert (fold.word, fold.status.value) == (info["word"], info["status"])
    assert fold.energy == info["energy"]


def test_the_exported_scene_holds_what_was_chosen() -> None:
    env = TubeFeedEnv(randomisation="none", baseline=None)
    env.reset(seed=0)
    for pattern, level in [(0, 0), (15, 8), (8, 4), (1, 2), (5, 6), (10, 3)]:
        env.step(np.array([pattern, level]))
    scene = env.to_scene()
    assert scene.sequence == ("NNNN", "SSSS", "SNNN", "NNNS", "NSNS", "SNSN")
    np.testing.assert_allclose(scene.speeds, env.actions.speeds[[0, 8, 4, 2, 6, 3]])
    assert scene.feed.loading == "at_mouth"


def test_fixing_the_target_leaves_the_physics_as_they_were() -> None:
    env = TubeFeedEnv(baseline=None)
    words = set()
    scenes = set()
    for target in ("LRLLL", "RRRLR", None):
        _, info = play(env, 11, target)
        words.add(info["target"])
        scenes.add(env.to_scene().model_dump_json())
    assert {"LRLLL", "RRRLR"} <= words
    assert len(scenes) == 1


def test_every_target_is_drawn() -> None:
    env = TubeFeedEnv(baseline=None)
    env.reset(seed=0)
    drawn = {env.reset()[1]["target"] for _ in range(300)}
    assert drawn == set(env.targets)


def test_the_reward_is_the_score_above_the_baseline_at_the_end() -> None:
    for seed, env in enumerate((TubeFeedEnv(), TubeFeedEnv(), TubeFeedEnv(baseline=None))):
        rewards, info = play(env, seed)
        assert rewards[-1] == pytest.approx(info["score"] - info["baseline"])
        assert info["baseline"] == env.baseline_of(info["target"]).score
        assert info["baseline_missing"] == (seed == 2)


def test_an_outline_is_reached_by_any_word_that_covers_it() -> None:
    word, other = "LLRRL", goal_words("LLRRL", "outline")[1]
    for match in ("word", "outline"):
        env = TubeFeedEnv(match=match, targets=[word], randomisation="none", baseline=None)
        design: Any = TubeFeedEnv(randomisation="none").baseline_of(other)
        env.reset(seed=0)
        info: dict = {}
        for faces in design.sequence:
            *_, info = env.step(env.actions.encode(faces, design.speed))
        assert info["word"] == other
        assert info["is_success"] == (match == "outline")
        assert (info["score"] == 1.0) == (match == "outline")


def test_chains_of_any_length_can_be_fed() -> None:
    for components in (2, 9):
        env = TubeFeedEnv(components=components, baseline=None)
        _, info = play(env, 0)
        assert info["step"] == components
        assert env.to_scene().n == components


def test_the_minimisers_design_earns_about_nothing() -> None:
    env = SequenceDesignEnv(randomisation="none")
    rewards = []
    for target in ("LRLLL", "RLRLR"):
        env.reset(seed=0, options={"target": target})
        design: Any = env.baseline
        rewards.append(env.step(env.actions.encode(design.sequence, design.speed))[1])
    assert rewards == pytest.approx([0.0, 0.0])


def test_a_quasistatic_design_is_the_minimisers_prediction() -> None:
    env = SequenceDesignEnv(fidelity="quasistatic", components=8, targets=["LRLRLRL"])
    rng = np.random.default_rng(0)
    for _ in range(10):
        env.reset()
        *_, info = env.step(rng.integers(env.action_space.nvec))  # pyright: ignore[reportAttributeAccessIssue]
        assert info["word"] == mf.minimise(env.to_scene(), mode="forward").states[0].word
