"""Tests that native vector environments and single environments give identical results."""

import os
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode

import magfold_env as mf
from tests.envs.vectors import alike, pair, play, same

QUICK: dict[str, Any] = {"components": 3, "baseline": None}
NEXT, SAME, NEVER = AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED
FEED, FLOOR = "MagFold/TubeFeed-v0", "MagFold/UnknownFloor-v0"
LONG = {"fidelity": "quasistatic", "components": 16, "targets": ["LRLRLRLRLRLRLRL"]}
ANY = {"spreads": {"friction": 0.2, "mass": 0.3, "remanence": 0.1, "feed_speed": 0.1}}
BACKWARD = mf.load_scene("tube-feed").replace(feed={"direction": "backward"}, **ANY)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_episodes_may_end_at_different_steps(mode: AutoresetMode) -> None:
    assert alike("MagFold/Tray-v0", 3, mode, 30, speeds=2)
    assert alike(FEED, 3, mode, 20, scene=BACKWARD, **LONG)


@pytest.mark.parametrize("fidelity", ["dynamics", "quasistatic"])
@pytest.mark.parametrize("shaping", ["similarity", "energy"])
@pytest.mark.parametrize("match", ["word", "outline"])
def test_rewards_are_alike(match: str, shaping: str, fidelity: str) -> None:
    options = {"match": match, "shaping": shaping, "gamma": 0.9, "catalogue": ["NSNS", "NNSS"]}
    assert alike(FEED, 2, NEXT, 6, fidelity=fidelity, components=4, reward="score", **options)
    assert alike(FEED, 1, SAME, 3, fidelity=fidelity, components=3, reward="sparse")
    assert alike(FEED, 2, SAME, 6, fidelity=fidelity)  # less a baseline


@pytest.mark.parametrize("randomisation", ["none", "strong", "scene"])
def test_draws_are_alike(randomisation: str) -> None:
    options = QUICK | {"randomisation": randomisation, "scene": BACKWARD}
    assert alike(FEED, 2, SAME, 7, **options)
    for loading in ("preloaded", "at_mouth"):
        scene = BACKWARD.replace(feed={"loading": loading})
        assert alike("MagFold/SequenceDesign-v0", 2, NEXT, 3, **options | {"scene": scene})


def test_results_do_not_depend_on_threads() -> None:
    said = [
        play(gymnasium.make_vec(FEED, num_envs=5, threads=threads, **QUICK), 8)
        for threads in (1, 2, 7, None)
    ]
    assert all(same(each, said[0]) for each in said)


def test_targets_can_be_given_and_are_kept_in_a_state() -> None:
    env: Any = gymnasium.make_vec(FEED, num_envs=3, fidelity="quasistatic")
    words = ["LRLLL", "LLRLL", "LRLLL"]
    assert env.reset(options={"target": words})[1]["target"].tolist() == words
    observation, info = env.reset(seed=2, options={"target": "LLRLL"})
    assert info["target"].tolist() == ["LLRLL"] * 3
    for k in range(3):
        single: Any = gymnasium.make(FEED, fidelity="quasistatic")
        first, _ = single.reset(seed=2 + k, options={"target": "LLRLL"})
        np.testing.assert_array_equal(observation[k], first)
    env: Any = gymnasium.make_vec(FEED, num_envs=2, fidelity="quasistatic").unwrapped
    env.reset(seed=0, options={"target": "LRLLL"})
    state = env.get_state()
    env.reset()
    env.set_state(state)
    assert env.episodes.goals.names.tolist() == ["LRLLL", "LRLLL"]


def test_seeds_are_each_environments_own() -> None:
    env: Any = gymnasium.make_vec(FEED, num_envs=3, **QUICK)
    told = env.reset(seed=[4, None, 9])[0]
    for k, seed in ((0, 4), (2, 9)):
        single: Any = gymnasium.make(FEED, **QUICK)
        np.testing.assert_array_equal(told[k], single.reset(seed=seed)[0])
    again = env.reset(seed=[4, None, 9])[0]
    np.testing.assert_array_equal(told[[0, 2]], again[[0, 2]])
    mask = np.array([False, True, False])
    kept = env.reset(seed=7, options={"reset_mask": mask})[0]
    np.testing.assert_array_equal(kept[[0, 2]], again[[0, 2]])


@pytest.mark.medium
@pytest.mark.parametrize("kind", ["discrete", "box"])
def test_chains_that_go_forth_and_back_are_alike(kind: str) -> None:
    options = {"actions": kind, "shaping": "energy", "gamma": 0.9, "randomisation": "strong"}
    assert alike(FLOOR, 3, SAME, 255, **options)  # the time is over after 250
    assert alike(FLOOR, 2, NEXT, 255, scene="tube-feed", shaping="energy")


def test_tasks_can_be_given() -> None:
    env: Any = gymnasium.make_vec(FLOOR, num_envs=3)
    tasks = env.unwrapped.template.tasks
    for given in ([4, 0, 7], np.array([4, 0, 7]), (4, 0, 7)):
        told = env.reset(seed=2, options={"task": given})
        assert told[1]["target"].tolist() == [tasks[number].target for number in (4, 0, 7)]
    for k, number in enumerate((4, 0, 7)):
        single: Any = gymnasium.make(FLOOR)
        first, _ = single.reset(seed=2 + k, options={"task": np.int64(number)})
        np.testing.assert_array_equal(told[0][k], first)
    assert set(env.reset(options={"task": np.int64(5)})[1]["target"]) == {tasks[5].target}
    with pytest.raises(ValueError, match=r"options\['task'\]: 2 numbers are not allowed"):
        env.reset(options={"task": [1, 2]})
    with pytest.raises(ValueError, match=r"options\['task'\]: 2.5 is .* must be a whole n"):
        env.reset(options={"task": 2.5})


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_processes_may_be_forked_afterwards() -> None:
    native = gymnasium.make_vec(FEED, num_envs=4, threads=2, **QUICK)
    expected = play(native, 5)
    singles = [lambda: gymnasium.make(FEED, **QUICK)] * 4
    forked = AsyncVectorEnv(singles, context="fork")
    assert same(play(forked, 5), expected)
    forked.close()
    assert same(play(native, 5), expected)


@pytest.mark.parametrize("fidelity", ["dynamics", "quasistatic"])
def test_pictures_are_those_of_single_environments(fidelity: str) -> None:
    for mode in ("rgb_array", "ansi"):
        options = QUICK | {"baseline": None, "render_mode": mode, "fidelity": fidelity}
        native, single = pair(FEED, 2, NEXT, **options)
        for env in (native, single):
            play(env, 2)
        assert same(native.render(), single.render())
        for env in (native, single):
            env.step(np.array([[3, 2], [9, 6]]))
        assert same(native.render(), single.render())


@pytest.mark.parametrize("env_id", [FEED, FLOOR])
def test_pickled_states_are_small(env_id: str) -> None:
    env: Any = gymnasium.make_vec(env_id, num_envs=4, autoreset_mode=SAME).unwrapped
    play(env, 3)
    assert len(pickle.dumps(env.get_state())) < 40_000 * 4
