"""What holds for every environment, however its actions are written."""

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_match import check_environments_match
from stable_baselines3.common.env_checker import check_env as sb3_check_env

from magfold_env.envs import ENTRY_POINTS, register_envs
from magfold_env.envs.camera_track import TIME_COST
from tests.envs.vectors import TRACKS, TRAYS, kinds_of

FIDELITIES = ("dynamics", "quasistatic")


def variants() -> list[Any]:
    """Every id with every way to write its actions and, where it has them, both fidelities."""
    found = []
    for env_id in ENTRY_POINTS:
        for kind in kinds_of(env_id):
            for fidelity in FIDELITIES:
                options: dict[str, Any] = {"actions": kind, "fidelity": fidelity}
                if env_id in TRACKS and fidelity == "quasistatic":
                    continue
                if env_id not in TRACKS:
                    # Short chains fold fast, and `discrete` cannot have longer sequences.
                    options["components"] = 3
                if env_id in ("MagFold/TubeFeed-v0", "MagFold/SequenceDesign-v0"):
                    options["baseline"] = None
                name = f"{env_id.split('/')[1]}-{kind}-{fidelity}"
                found.append(pytest.param(env_id, options, id=name))
    return found


every_variant = pytest.mark.parametrize(("env_id", "options"), variants())
every_id = pytest.mark.parametrize("env_id", list(ENTRY_POINTS))


def play(env: gymnasium.Env, seed: int) -> list[Any]:
    """Play an episode of random actions; return all that the environment said."""
    env.action_space.seed(seed)
    said: list[Any] = [env.reset(seed=seed)]
    ended = False
    while not ended:
        said.append(env.step(env.action_space.sample()))
        ended = said[-1][2] or said[-1][3]
    return said


def same(one: Any, other: Any) -> bool:
    """Whether two things that environments say are equal, bit for bit."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(np.array_equal(one, other, equal_nan=isinstance(one, float)))


@every_variant
def test_both_checkers_pass(env_id: str, options: dict) -> None:
    env = gymnasium.make(env_id, **options).unwrapped
    check_env(env, skip_render_check=True)
    sb3_check_env(env)


@every_variant
def test_equal_seeds_give_equal_episodes(env_id: str, options: dict) -> None:
    first, second = (gymnasium.make(env_id, **options) for _ in range(2))
    check_environments_match(first, second, num_steps=15, seed=3)


@pytest.mark.parametrize("fidelity", FIDELITIES)
@every_id
def test_pickles_and_deep_copies_go_on_alike(env_id: str, fidelity: str) -> None:
    if env_id in TRACKS and fidelity == "quasistatic":
        pytest.skip("has no such fidelity")
    env = gymnasium.make(env_id, fidelity=fidelity).unwrapped
    env.reset(seed=5)
    env.action_space.seed(5)
    action = env.action_space.sample()
    if env_id != "MagFold/SequenceDesign-v0":
        env.step(action)
    twins = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
    expected = [env.step(action), *play(env, 6)]
    for twin in twins:
        assert same([twin.step(action), *play(twin, 6)], expected)


@pytest.mark.parametrize("fidelity", FIDELITIES)
@every_id
def test_a_state_can_be_returned_to(env_id: str, fidelity: str) -> None:
    if env_id in TRACKS and fidelity == "quasistatic":
        pytest.skip("has no such fidelity")
    env: Any = gymnasium.make(env_id, fidelity=fidelity).unwrapped
    other: Any = gymnasium.make(env_id, fidelity=fidelity).unwrapped
    said: list[Any] = [env.reset(seed=7)]
    env.action_space.seed(7)
    states, actions = [env.get_state()], []
    while not (len(said) > 1 and (said[-1][2] or said[-1][3])):
        actions.append(env.action_space.sample())
        said.append(env.step(actions[-1]))
        states.append(env.get_state())
    after = env.reset()
    for start in sorted({len(states) - 1, len(states) // 2, 1, 0}, reverse=True):
        for one in (env, other):
            observation, info = one.set_state(states[start])
            assert same(observation, said[start][0])
            assert same(info, said[start][-1])
            for k in range(start, len(actions)):
                assert same(one.step(actions[k]), said[k + 1])
            # Random numbers are part of the state.
            assert same(one.reset(), after)


@every_id
def test_no_observation_shares_memory_with_another(env_id: str) -> None:
    said = play(gymnasium.make(env_id).unwrapped, 0)
    kept = copy.deepcopy([each[0] for each in said])
    play(gymnasium.make(env_id).unwrapped, 1)
    assert same([each[0] for each in said], kept)


@every_id
def test_steps_on_the_way_are_all_worth_the_same_without_shaping(env_id: str) -> None:
    said = play(gymnasium.make(env_id).unwrapped, 2)
    rewards = [each[1] for each in said[1:]]
    if env_id in TRAYS:
        times = np.array([each[-1]["time"] for each in said])
        np.testing.assert_allclose(rewards[:-1], -TIME_COST * np.diff(times)[:-1])
        return
    wanted = -4e-4 if env_id in TRACKS else {"MagFold/TubeFeedGoal-v0": -1.0}.get(env_id, 0.0)
    assert rewards[:-1] == [wanted] * (len(rewards) - 1)
    assert -1.0 <= rewards[-1] <= 1.0


@every_id
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"actions": "tuple"}, "actions: 'tuple' is not allowed; must be one of multidiscrete"),
        ({"speeds": 1}, "speeds: 1 is not allowed; must be 2 or more"),
        ({"speeds": 2.5}, "speeds: 2.5 is not allowed; must be 2 or more, a whole number"),
        ({"difficulty": "x"}, "difficulty: 'x' is not allowed; must be above 0 and at most 1"),
        ({"difficulty": 0.0}, "difficulty: 0.0 is not allowed; must be above 0 and at most 1"),
        ({"fidelity": "exact"}, "fidelity: 'exact' is not allowed; must be"),
        ({"match": "cells"}, "match: 'cells' is not allowed; must be one of word, outline"),
        ({"randomisation": "wild"}, "randomisation: 'wild' is not allowed; must be one of none"),
        ({"render_mode": "video"}, "render_mode: 'video' is not allowed; must be None or one of"),
        ({"target": "LRLLL"}, "target: unknown option, must be one of scene, "),
        ({"scene": "tube-fed"}, "tube-fed: no such scene"),
        ({"scene": "pendulum-3"}, "scene.mount: 'pinned' is not allowed; must be 'tube'"),
    ],
)
def test_wrong_options_are_named(env_id: str, options: dict, message: str) -> None:
    module, name = ENTRY_POINTS[env_id].split(":")
    make = getattr(__import__(module, fromlist=[name]), name)
    with pytest.raises(ValueError, match=message):
        make(**options)


@every_id
def test_rendering_gives_pictures_and_text(env_id: str) -> None:
    picture = gymnasium.make(env_id, render_mode="rgb_array")
    picture.reset(seed=0)
    image: Any = picture.render()
    assert image.dtype == np.uint8
    assert image.shape[2:] == (3,)
    assert image.std() > 0
    text = gymnasium.make(env_id, render_mode="ansi")
    text.reset(seed=0)
    assert str(text.render()).startswith("target ")


def test_registering_again_changes_nothing() -> None:
    specs = [gymnasium.spec(env_id) for env_id in ENTRY_POINTS]
    register_envs()
    for env_id, spec in zip(ENTRY_POINTS, specs, strict=True):
        assert gymnasium.spec(env_id) is spec
        assert spec.max_episode_steps is None
