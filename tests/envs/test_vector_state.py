"""Vector environments go back to any moment of theirs."""

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from magfold_env.envs.vector_env import ChainVectorEnv

QUICK: dict[str, Any] = {"fidelity": "quasistatic", "shaping": "similarity"}
CASES = [
    pytest.param("MagFold/TubeFeed-v0", QUICK, id="quasistatic"),
    pytest.param("MagFold/TubeFeed-v0", {"shaping": "energy"}, id="dynamics"),
    pytest.param("MagFold/TubeFeed-v0", {"actions": "box", "randomisation": "strong"}, id="box"),
    pytest.param("MagFold/TubeFeedGoal-v0", {}, id="goals"),
    pytest.param("MagFold/SequenceDesign-v0", {}, id="whole chains"),
    pytest.param("MagFold/UnknownFloor-v0", {}, id="unknown floor"),
    pytest.param("MagFold/Reprogram-v0", {}, id="reprogram"),
    pytest.param("MagFold/Lumen-v0", {}, id="lumen"),
    pytest.param("MagFold/Tray-v0", {"shaping": "energy"}, id="tray"),
    pytest.param("MagFold/Anchor-v0", {}, id="anchor"),
]


def made(env_id: str, options: dict[str, Any], count: int = 5) -> Any:
    mode = AutoresetMode.SAME_STEP
    env = gymnasium.make_vec(env_id, num_envs=count, autoreset_mode=mode, **options).unwrapped
    assert isinstance(env, ChainVectorEnv)
    return env


def told(env: Any, actions: list[Any]) -> list[Any]:
    """Return all that the environment says to some actions, infos as text."""
    said = [env.step(action) for action in actions]
    return [(repr(observation), *map(np.ndarray.tolist, rest[:3])) for observation, *rest in said]


@pytest.mark.parametrize(("env_id", "options"), CASES)
def test_a_state_goes_on_as_it_did(env_id: str, options: dict[str, Any]) -> None:
    np.set_printoptions(threshold=10**6, floatmode="unique")
    env, other = made(env_id, options), made(env_id, options)
    env.action_space.seed(0)
    env.reset(seed=3)
    # Episodes of different ages: one is begun anew in the middle of the others'.
    told(env, [env.action_space.sample() for _ in range(2)])
    env.reset(options={"reset_mask": np.array([True, False, False, True, False])})
    told(env, [env.action_space.sample()])
    state = env.get_state()
    actions = [env.action_space.sample() for _ in range(9)]
    before = told(env, actions)
    seen = repr(env.set_state(state))
    assert told(env, actions) == before
    assert repr(other.set_state(pickle.loads(pickle.dumps(state)))) == seen
    assert told(other, actions) == before
    env.close()
    other.close()


def test_a_target_that_was_given_is_kept() -> None:
    env = made("MagFold/TubeFeed-v0", QUICK, 2)
    env.reset(seed=0, options={"target": "LRLLL"})
    state = env.get_state()
    env.reset()
    env.set_state(state)
    assert env.episodes.goals.names.tolist() == ["LRLLL", "LRLLL"]


@pytest.mark.parametrize("env_id", ["MagFold/TubeFeed-v0", "MagFold/UnknownFloor-v0"])
def test_pickled_states_are_small(env_id: str) -> None:
    single: Any = gymnasium.make(env_id).unwrapped
    for env, count in ((single, 1), (made(env_id, {}, 4), 4)):
        env.action_space.seed(0)
        env.reset(seed=0)
        for _ in range(3):
            env.step(env.action_space.sample())
        assert len(pickle.dumps(env.get_state())) < 40_000 * count


def test_there_is_no_state_before_the_first_reset() -> None:
    with pytest.raises(ResetNeeded):
        made("MagFold/TubeFeed-v0", QUICK).get_state()
