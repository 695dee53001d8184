import gymnasium
import numpy as np
import pytest

from magfold_env.envs.tube_feed_goal import TubeFeedGoalEnv
from magfold_env.shapes import folded_words, outline, word_to_angles


def goal(word: str, settled: float = 1.0) -> np.ndarray:
    return np.append(word_to_angles(word), settled).astype(np.float32)


@pytest.mark.parametrize("match", ["word", "outline"])
def test_rewards_of_a_batch_are_those_of_its_rows(match: str) -> None:
    env = TubeFeedGoalEnv(match=match, fidelity="quasistatic")  # pyright: ignore[reportArgumentType]
    words = folded_words(6)
    achieved = np.array([goal(a) for a in words for _ in words])
    desired = np.array([goal(b) for _ in words for b in words])
    infos = [{"anything": None}] * len(achieved)
    batch = env.compute_reward(achieved, desired, infos)
    assert isinstance(batch, np.ndarray)
    assert batch.shape == (26 * 26,)
    for row, (one, other) in enumerate((a, b) for a in words for b in words):
        alike = one == other if match == "word" else outline(one) == outline(other)
        assert batch[row] == (0.0 if alike else -1.0)
        assert env.compute_reward(achieved[row], desired[row], {}) == batch[row]


def test_a_goal_wants_its_angles_and_rest() -> None:
    env = TubeFeedGoalEnv(fidelity="quasistatic")
    wanted = goal("LRLLL")
    for joint in range(5):
        near, far = wanted.copy(), wanted.copy()
        near[joint] += 0.04
        far[joint] += 0.06
        assert env.compute_reward(near, wanted, None) == 0.0
        assert env.compute_reward(far, wanted, None) == -1.0
    assert env.compute_reward(goal("LRLLL", 0.0), wanted, None) == -1.0
    assert env.compute_reward(goal("LRLLL", 0.0), goal("LRLLL", 0.0), None) == 0.0
    assert env.compute_reward(wanted, goal("LRLLL", 0.0), None) == 0.0


@pytest.mark.parametrize("fidelity", ["dynamics", "quasistatic"])
def test_what_was_achieved_would_have_been_rewarded(fidelity: str) -> None:
    env = gymnasium.make("MagFold/TubeFeedGoal-v0", fidelity=fidelity, components=3)
    env.action_space.seed(1)
    reached = set()
    for seed in range(40):
        observation, info = env.reset(seed=seed)
        ended, reward = False, 0.0
        while not ended:
            observation, reward, ended, _, info = env.step(env.action_space.sample())
            achieved, desired = observation["achieved_goal"], observation["desired_goal"]
            goal_env: TubeFeedGoalEnv = env.unwrapped  # pyright: ignore[reportAssignmentType]
            assert goal_env.compute_reward(achieved, desired, {}) == reward
            assert goal_env.compute_reward(achieved, achieved, {}) == 0.0
        assert (reward == 0.0) == info["is_success"]
        assert observation["achieved_goal"][-1] == (info["status"] in ("folded", "misfolded"))
        reached.add(reward)
    assert reached == {0.0, -1.0}


def test_the_observation_does_not_show_the_goal() -> None:
    env = TubeFeedGoalEnv(fidelity="quasistatic")
    seen = [env.reset(seed=0, options={"target": word})[0] for word in ("LRLLL", "RRRLR")]
    np.testing.assert_array_equal(seen[0]["observation"], seen[1]["observation"])
    assert seen[0]["observation"].shape == (14 * 6 - 1,)
    np.testing.assert_allclose(seen[0]["desired_goal"], goal("LRLLL"))
