import gymnasium
import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.tube_feed import TubeFeedEnv


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"gamma": 1.5}, "gamma: 1.5 is not allowed; must be between 0 and 1"),
        (
            {"reward": "best"},
            "reward: 'best' is not allowed; must be one of relative, score, sparse",
        ),
        (
            {"shaping": "speed"},
            "shaping: 'speed' is not allowed; must be one of True, False, simil",
        ),
        ({"baseline": "best"}, "baseline: 'best' is not allowed; must be 'auto' or None"),
        ({"components": 6.5}, "components: 6.5 is not allowed; must be a whole number, at least 2"),
        ({"components": "6"}, "components: '6' is not allowed; must be a whole number, at least 2"),
        ({"targets": ["SSSSS"]}, "targets: 'SSSSS' is not allowed; must be a fully folded word"),
    ],
)
def test_wrong_arguments_are_named(kwargs: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TubeFeedEnv(**kwargs)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mount": "free"}, "scene.mount: 'free' is not allowed"),
        ({"feed": {"loading": "preloaded"}}, "scene.feed.loading: 'preloaded' is not allowed"),
        ({"magnets": None}, "scene.magnets: None is not allowed"),
        ({"sequence": ("NSNS",)}, r"scene.sequence: \('NSNS',\) is not allowed"),
    ],
)
def test_scenes_that_cannot_be_fed_one_by_one_are_refused(changes: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TubeFeedEnv(mf.load_scene("tube-feed").replace(**changes))


def test_a_field_leaves_the_reward_without_a_baseline() -> None:
    scene = mf.load_scene("tube-feed").replace(field={"uniform": (0.0, 1e-3)})
    with pytest.raises(ValueError, match=r"baseline: 'auto' is not allowed with scene.field"):
        TubeFeedEnv(scene)
    assert TubeFeedEnv(scene, baseline=None).scene.field == scene.field
    assert TubeFeedEnv(scene.replace(field={"uniform": (0.0, 0.0)})).scene.n == 6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target": "LLLLL"}, r"options\['target'\]: 'LLLLL' is not allowed; must be one of"),
        ({"target": 3}, r"options\['target'\]: 3 is not allowed; must be one of"),
        ({"word": "LRLLL"}, "options: 'word' is not allowed; must be one of target"),
    ],
)
def test_wrong_options_are_named(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TubeFeedEnv(baseline=None).reset(options=options)


def test_a_wrong_action_is_named_and_leaves_the_episode_as_it_was() -> None:
    env = TubeFeedEnv(baseline=None)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"action: .*16.* is not allowed"):
        env.step(np.array([16, 0]))
    assert env.next_component == 0
    env.step(np.array([15, 0]))
    assert env.next_component == 1


def test_stepping_needs_a_running_episode() -> None:
    env = TubeFeedEnv(baseline=None)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0, 0]))
    env.reset(seed=0)
    for _ in range(6):
        env.step(np.array([6, 4]))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0, 0]))
    with pytest.raises(RuntimeError, match="every component has been fed"):
        _ = env.next_component


def test_half_an_episode_is_not_a_scene() -> None:
    env = TubeFeedEnv(baseline=None)
    env.reset(seed=0)
    env.step(np.array([0, 0]))
    with pytest.raises(RuntimeError, match="1 of 6 components are set"):
        env.to_scene()
