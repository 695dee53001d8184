from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.wrappers.curriculum import Curriculum
from tests.envs import contract

QUICK: dict[str, Any] = {"fidelity": "quasistatic"}
LENGTHS = ({"components": 3}, {"components": 4})


def quick() -> gymnasium.Env:
    return gymnasium.make("MagFold/TubeFeed-v0", **QUICK)


def play(env: gymnasium.Env, seed: int | None = None) -> tuple[list[np.ndarray], dict]:
    said = contract.play(env, seed)
    return [each[0] for each in said], said[-1][-1]


def check_wrapped(env: gymnasium.Env) -> None:
    """Check an environment whose checker would rather see it without its wrapper."""
    with pytest.warns(UserWarning, match="different from the unwrapped version"):
        check_env(env, skip_render_check=True)


@pytest.mark.medium
def test_success_leads_from_stage_to_stage() -> None:
    env = Curriculum(quick(), LENGTHS, threshold=0.01, window=2000)
    env.action_space.seed(0)
    assert env.reset(seed=0)[1]["stage"] == 0
    stages = [play(env)[1]["stage"] for _ in range(4500)]
    assert stages == sorted(stages)
    assert set(stages) == {0, 1, 2}
    # Not before a whole window of episodes has been seen.
    assert stages.index(1) >= 2000


def test_failure_keeps_the_stage() -> None:
    env = Curriculum(quick(), LENGTHS, threshold=1.0, window=20)
    env.action_space.seed(0)
    env.reset(seed=0)
    assert {play(env)[1]["stage"] for _ in range(100)} == {0}


def test_short_chains_are_shown_as_the_beginning_of_long_ones() -> None:
    env = Curriculum(quick(), LENGTHS)
    check_wrapped(env)
    short = gymnasium.make("MagFold/TubeFeed-v0", components=3, **QUICK)
    seen, expected = env.reset(seed=3)[0], short.reset(seed=3)[0]
    for action in ([3, 0], [5, 0], [9, 0]):
        assert seen.shape == (17 * 6 - 4,)
        small = short.unwrapped.layout  # pyright: ignore[reportAttributeAccessIssue]
        large = gymnasium.make("MagFold/TubeFeed-v0", **QUICK).unwrapped.layout  # pyright: ignore[reportAttributeAccessIssue]
        for name, group in small.slices.items():
            shown = seen[large.slices[name]]
            size = group.stop - group.start
            np.testing.assert_array_equal(shown[:size], expected[group])
            assert not shown[size:].any()
        seen, expected = env.step(np.array(action))[0], short.step(np.array(action))[0]


def test_difficulty_may_be_a_stage_of_any_environment() -> None:
    for env_id in ("MagFold/TubeFeedGoal-v0", "MagFold/SequenceDesign-v0"):
        env = Curriculum(gymnasium.make(env_id, **QUICK), [{"difficulty": 0.1}])
        assert play(env, 0)[1]["stage"] == 0


def test_stages_that_do_not_go_together_are_named() -> None:
    env = quick()
    design = gymnasium.make("MagFold/SequenceDesign-v0", **QUICK)
    with pytest.raises(ValueError, match=r"stages: \[\] is not allowed"):
        Curriculum(env, [])
    with pytest.raises(ValueError, match=r"stages\[0\]: the actions .* are not allowed"):
        Curriculum(design, LENGTHS)
    with pytest.raises(ValueError, match=r"stages\[0\]: the observations .* are not allowed"):
        Curriculum(env, [{"components": 7}])
    with pytest.raises(ValueError, match="threshold: 2 is not allowed"):
        Curriculum(env, LENGTHS, threshold=2)
    with pytest.raises(ValueError, match="window: 0 is not allowed"):
        Curriculum(env, LENGTHS, window=0)
    with pytest.raises(
        ValueError, match=r"env: .* is not allowed; must be made by gymnasium\.make"
    ):
        Curriculum(TubeFeedEnv(fidelity="quasistatic"), LENGTHS)


def test_wrapped_environments_can_be_made_from_their_specs() -> None:
    env = Curriculum(quick(), LENGTHS, window=7)
    assert env.spec is not None
    again = gymnasium.make(env.spec)
    for one, other in zip(play(env, 5)[0], play(again, 5)[0], strict=True):
        np.testing.assert_array_equal(one, other)
