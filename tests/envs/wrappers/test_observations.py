from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import FlattenObservation, FrameStackObservation

from magfold_env.envs.wrappers import vector
from magfold_env.envs.wrappers.mouth_order import WIDTHS, MouthOrderObservation
from magfold_env.scene import load_scene
from tests.envs.vectors import play, same

QUICK: dict[str, Any] = {"fidelity": "quasistatic", "components": 4}
TUBE_FEED = "MagFold/TubeFeed-v0"


def single() -> gymnasium.Env:
    return gymnasium.make(TUBE_FEED, **QUICK)


def native(mode: AutoresetMode, env_id: str = TUBE_FEED, count: int = 3) -> Any:
    return gymnasium.make_vec(env_id, num_envs=count, autoreset_mode=mode, **QUICK)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_vector_wrappers_say_what_those_of_single_environments_say(mode: AutoresetMode) -> None:
    ordered = vector.MouthOrderObservation(native(mode))
    expected = SyncVectorEnv([lambda: MouthOrderObservation(single())] * 3, autoreset_mode=mode)
    assert ordered.observation_space == expected.observation_space
    assert ordered.single_observation_space == expected.single_observation_space
    assert same(play(ordered, 40), play(expected, 40))
    stacked = vector.FrameStackObservation(native(mode), 3)
    expected = SyncVectorEnv([lambda: FrameStackObservation(single(), 3)] * 3, autoreset_mode=mode)
    assert stacked.observation_space == expected.observation_space
    assert stacked.single_observation_space == expected.single_observation_space
    assert same(play(stacked, 40), play(expected, 40))


def test_vector_wrappers_go_around_gymnasiums_own_vectors() -> None:
    mode = AutoresetMode.NEXT_STEP
    own = SyncVectorEnv([single] * 3, autoreset_mode=mode)
    ordered = vector.FrameStackObservation(vector.MouthOrderObservation(own), 2)
    expected = vector.FrameStackObservation(vector.MouthOrderObservation(native(mode)), 2)
    assert same(play(ordered, 20), play(expected, 20))


def test_stacks_of_those_not_reset_stay_as_they_are() -> None:
    env = vector.FrameStackObservation(native(AutoresetMode.DISABLED), 2)
    env.action_space.seed(0)
    env.reset(seed=0)
    before = env.step(env.action_space.sample())[0]
    after, _ = env.reset(options={"reset_mask": np.array([False, True, False])})
    np.testing.assert_array_equal(after[[0, 2]], before[[0, 2]])
    np.testing.assert_array_equal(after[1, 0], after[1, 1])


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_the_component_that_left_last_comes_first(direction: str) -> None:
    scene = load_scene("tube-feed").replace(feed={"direction": direction})
    env = MouthOrderObservation(gymnasium.make(TUBE_FEED, scene=scene, **QUICK))
    env.reset(seed=0)
    n = QUICK["components"]
    # Before the components' groups: what is wanted ahead and behind, and the angles behind.
    magnets = slice((2 * 3 + 1) * (n - 1), (2 * 3 + 1) * (n - 1) + 4 * n)
    assert next(iter(WIDTHS)) == "magnets"
    patterns = [8, 4, 2, 1]  # one S face each, the first to the last
    for step, pattern in enumerate(patterns, 1):
        seen = env.step(np.array([pattern, 0]))[0][magnets].reshape(n, 4)
        assert np.argmin(seen, axis=1)[:step].tolist() == list(range(step))[::-1]
        assert not seen[step:].any()


def test_wrapped_environments_pass_the_checker_and_can_be_made_from_their_specs() -> None:
    env: Any = FlattenObservation(FrameStackObservation(MouthOrderObservation(single()), 2))
    with pytest.warns(UserWarning, match="different from the unwrapped version"):
        check_env(env, skip_render_check=True)
    again = gymnasium.make(env.spec)
    np.testing.assert_array_equal(env.reset(seed=1)[0], again.reset(seed=1)[0])


def test_what_cannot_be_shown_so_is_named() -> None:
    goal, floor = "MagFold/TubeFeedGoal-v0", "MagFold/UnknownFloor-v0"
    refused = r"env: observations of .* must be those of MagFold/TubeFeed-v0"
    for other in (gymnasium.make(goal, **QUICK), gymnasium.make(floor)):
        with pytest.raises(ValueError, match=refused):
            MouthOrderObservation(other)
    with pytest.raises(ValueError, match=refused):
        vector.MouthOrderObservation(gymnasium.make_vec(floor, num_envs=2))
    with pytest.raises(ValueError, match=r"env: observations Dict.* must be a Box"):
        vector.FrameStackObservation(native(AutoresetMode.SAME_STEP, goal), 2)
    with pytest.raises(ValueError, match="stack_size: 0 is not allowed; must be from 1"):
        vector.FrameStackObservation(native(AutoresetMode.SAME_STEP), 0)
