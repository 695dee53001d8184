"""Tests of `Reprogram`: a chain folds, is retracted and folds again, on an unknown floor."""

from typing import Any

import numpy as np
import pytest

from magfold_env.envs.baselines.legs import Following
from magfold_env.envs.baselines.three_speeds import PULLS, PUSHES, Speeds, push_pull_push
from magfold_env.envs.camera_track import replay
from magfold_env.envs.chains.arrays import FOLDED
from magfold_env.envs.reprogram import (
    BACK,
    FIRST,
    HORIZON,
    LASTING,
    SECOND,
    ReprogramEnv,
    ReprogramVectorEnv,
)
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import load_scene
from magfold_env.shapes import word_to_angles

EASIEST = 4
"""Tasks in these tests, in which a schedule most often leads to both words."""


def following(*speeds: Speeds) -> Following:
    """Return a plan that plays schedules of three speeds."""
    return Following([push_pull_push(load_scene("reprogram"), each) for each in speeds])


def rolls(count: int = 24, **options: Any) -> tuple[ChainVectorEnv[Any], list[Any], list[Any]]:
    """Play schedules of three speeds in the easiest tasks.

    Returns the environments, the results of every step, and the chains after each step.
    """
    envs = ReprogramVectorEnv(count, autoreset_mode="Disabled", threads=1, **options)
    tasks = [number % EASIEST for number in range(count)]
    envs.reset(seed=1, options={"task": tasks})
    episodes: Any = envs.episodes
    speeds = [(PUSHES[k % 3], PULLS[k % 2], PUSHES[k // 8 % 3]) for k in range(count)]
    plan, rows, said, chains = following(*speeds), episodes.rows, [], []
    while len(rows):
        rewards, ends = episodes.step(rows, plan(episodes, rows))
        chains.append((episodes.stage.copy(), episodes.arrays.angles.copy(), episodes.is_in(rows)))
        said.append((rows, rewards, ends))
        rows = rows[~episodes.terminated[rows]]
    return envs, said, chains


@pytest.fixture(scope="module")
def played() -> tuple[ChainVectorEnv[Any], list[Any], list[Any]]:
    return rolls()


@pytest.mark.medium
def test_schedules_reach_no_word_one_or_both(played: Any) -> None:
    envs = played[0]
    ends = envs.episodes.final_infos(envs.episodes.rows)
    assert set(ends["score"].tolist()) == {0.0, 0.5, 1.0}
    np.testing.assert_array_equal(ends["is_success"], ends["score"] == 1.0)
    np.testing.assert_array_equal(ends["score"] > 0.0, envs.episodes.stage > FIRST)


def test_a_success_is_the_second_fold_at_rest_after_the_first(played: Any) -> None:
    episodes = played[0].episodes
    ends = episodes.final_infos(episodes.rows)
    for row in episodes.rows:
        task = episodes.setup.tasks[episodes.numbers[row]]
        joints = np.diff(episodes.arrays.angles[row])
        off = np.abs(joints - word_to_angles(task.target)).max()
        reached = episodes.arrays.status[row] == FOLDED and off <= SUCCESS_TOLERANCE
        assert ends["is_success"][row] == (reached and episodes.stage[row] == SECOND)


def test_the_first_word_lasts_and_then_the_chain_is_drawn_in(played: Any) -> None:
    envs, said, chains = played
    setup, numbers = envs.episodes.setup, envs.episodes.numbers
    reached = 0
    for step in range(LASTING, len(chains)):
        for row in said[step][0]:
            if (chains[step - 1][0][row], chains[step][0][row]) != (FIRST, BACK):
                continue
            reached += 1
            first = word_to_angles(setup.tasks[numbers[row]].first)
            for before in range(step - LASTING + 1, step + 1):
                off = np.diff(chains[before][1][row]) - first
                assert np.abs(off).max() <= SUCCESS_TOLERANCE
    assert reached > 0
    _, said, chains = played
    drawn_in = 0
    for step in range(1, len(chains)):
        for place, row in enumerate(said[step][0]):
            before, after, inside = chains[step - 1][0][row], chains[step][0][row], chains[step][2]
            assert 0 <= after - before <= 1
            if before == BACK:
                assert (after == SECOND) == inside[place]
                drawn_in += after == SECOND
    assert drawn_in > 0


def feed(env: ReprogramEnv, plan: Following, steps: int = HORIZON) -> dict[str, Any]:
    """Feed by a schedule for at most a number of steps; return the last result."""
    info: dict[str, Any] = {}
    for _ in range(steps):
        speed = float(plan(env.episodes, np.array([0]))[0][0])
        *_, ended, _, info = env.step(env.actions.encode(speed))
        if ended:
            break
    return info


def test_a_chain_that_stands_still_in_its_first_word_is_late_and_has_half() -> None:
    env = ReprogramEnv()
    plan, info, seed = following((PULLS[0], PULLS[0], PULLS[0])), {"stage": FIRST}, 0
    while info["stage"] != BACK:
        info = env.reset(seed=seed, options={"task": seed % EASIEST})[1]
        plan, seed = following((PUSHES[seed % 3], 0.0, 0.0)), seed + 1
        while info["stage"] == FIRST and plan.at[0] < 2:
            info = feed(env, plan, 1)
    assert env.layout.slices["stage"].stop == env.layout.size == 12 * 6 + 5
    stage = env.episodes.observe()[0, env.layout.slices["stage"]]
    assert stage.tolist() == [0.0, 1.0, 0.0]
    assert info["target"] == env.task.target
    end = feed(env, plan)
    assert (end["status"], end["score"], end["is_success"]) == ("unsettled", 0.5, False)
    assert end["message"] == "late: not at rest and all out after 10 s"
    again = replay(env.to_scene(), env.history).arrays
    np.testing.assert_array_equal(again.angles[0], env.state.angles)


def test_all_out_the_first_word_counts_no_more() -> None:
    env, folded = ReprogramEnv(), 0
    for seed in range(12):
        env.reset(seed=seed)
        info: dict[str, Any] = {}
        while "status" not in info:
            *_, info = env.step(env.actions.encode(0.6))
        folded += info["status"] == "folded"
        assert (info["stage"], info["score"], info["is_success"]) == (FIRST, 0.0, False)
    assert folded > 0


def test_shipped_tasks_ask_for_two_words_of_a_chain() -> None:
    tasks = ReprogramEnv().tasks
    assert 16 <= len(tasks) <= 24
    assert {task.direction for task in tasks} == {"forward", "backward"}
    assert len({(task.sequence, task.direction) for task in tasks}) == len(tasks)
    for task in tasks:
        first, second = task.words
        assert first != second
