"""Tests of plans that retract wrong folds and release them again, or else play an open loop."""

from typing import Any

import numpy as np
import pytest

from agents.open_loops.schedules import LONGEST_PAUSE, constant
from agents.open_loops.search import RolloutPool, Search, open_loops_of
from agents.settings import EnvSettings
from agents.training import drawing_back, open_loops
from agents.training.envs import make_env
from magfold_env.envs.baselines.legs import Following, Leg
from magfold_env.envs.reprogram import BACK, FIRST, HORIZON, SECOND, ReprogramEnv
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE
from magfold_env.envs.unknown_floor import UnknownFloorEnv

SETTINGS = EnvSettings(id="MagFold/UnknownFloor-v0")
COUNT = 24


@pytest.fixture(scope="module")
def env() -> Any:
    return UnknownFloorEnv()


def played(env: Any, plan: Any, number: int) -> tuple[Any, Any, list[Any]]:
    """Return episodes of a task, their results, and joints, advances and speeds of every step.

    Joints are in the order of feed; the correct direction is positive.
    """
    episodes = env.make_episodes(env.setup, COUNT)
    told: list[Any] = []

    def noted(rows: Any) -> Any:
        (speeds,) = plan(episodes, rows)
        for row, speed in zip(rows.tolist(), speeds.tolist(), strict=True):
            turns = np.sign(episodes.goals.turns[row])
            joints = np.diff(episodes.arrays.angles[row]) * turns
            joints = joints if episodes.arrays.forward[row] else joints[::-1]
            out = bool(episodes.arrays.released[row].all())
            told.append((row, joints, float(episodes.chains.advances()[row]), speed, out))
        return (speeds,)

    assert episodes.goals.turns.shape == (COUNT, 5)
    ends = episodes.play(episode_seeds("drawing back test", COUNT), [number] * COUNT, noted)
    return episodes, ends, told


def test_a_joint_that_turns_the_wrong_way_is_drawn_in(env: Any) -> None:
    number, speed = 9, constant(0.05)
    found = drawing_back.Redoing(speed, constant(0.08), 0.5, 0.15, 0.2, -0.25)
    plan = drawing_back.DrawingBack([found] * COUNT)
    episodes, _, told = played(env, plan, number)
    diagonal = env.setup.scene.casing.diagonal
    goals = np.full(COUNT, np.nan)
    counts = np.zeros(COUNT, dtype=int)
    steps = np.zeros(COUNT)
    for row, joints, gone, asked, out in told:
        if gone <= goals[row] * diagonal:
            goals[row] = np.nan
        wrong = np.flatnonzero(joints < (-0.15 if gone > 5 * diagonal else -0.5))
        early = steps[row] * 0.02 < drawing_back.PATIENCE * episodes.late
        if np.isnan(goals[row]) and wrong.size and early and not out:
            goal = max(wrong[0] + 0.2, 0.02)
            if gone > goal * diagonal:
                goals[row], counts[row] = goal, counts[row] + 1
        expected = 0.05 if counts[row] == 0 else 0.08
        assert asked == (expected if np.isnan(goals[row]) else -0.25)
        steps[row] += 1
    np.testing.assert_array_equal(plan.times, counts)
    assert 0 < np.count_nonzero(counts) < COUNT


def test_where_nothing_turns_wrong_an_open_loop_is_played(env: Any) -> None:
    first = open_loops_of(env).candidates(60, 3)[57]
    plan = drawing_back.DrawingBack(
        [drawing_back.Redoing(first, first, 9.0, 9.0, 0.2, -0.25)] * COUNT
    )
    ends = [played(env, each, 3)[1] for each in (plan, Following([first.way] * COUNT))]
    assert not plan.times.any()
    np.testing.assert_array_equal(ends[0]["score"], ends[1]["score"])
    np.testing.assert_array_equal(ends[0]["energy"], ends[1]["energy"])


@pytest.mark.parametrize(
    ("gone", "leg"), [(0.0, 0), (0.019, 0), (0.02, 1), (0.045, 1), (0.05, 3), (0.2, 3)]
)
def test_legs_that_are_over_are_not_followed_anew(gone: float, leg: int) -> None:
    way = (Leg(0.1, 0.02), Leg(0.0, steps=3), Leg(0.2, 0.05), Leg(0.3))
    plan = Following([way, way[:1]])
    plan.at[:] = 2, 0
    plan.restart(np.array([0, 1]), np.array([gone, gone]))
    assert plan.at.tolist() == [leg, 0]


@pytest.fixture(scope="module")
def refolding() -> tuple[list[drawing_back.Refolding], list[Any]]:
    """Return plans that fold twice with different settings, and a record of all their steps."""
    env = ReprogramEnv()
    best = open_loops_of(env).candidates(100, 2)[84:]
    found = drawing_back.candidates_twice(best, 2, COUNT, env.setup.scene)
    return found, refolded(env, drawing_back.DrawingBackTwice(found), 2)


def refolded(env: ReprogramEnv, plan: drawing_back.DrawingBackTwice, number: int) -> list[Any]:
    """Return row, stage, joint errors [rad], advance and speed of every step of a task."""
    episodes: Any = env.make_episodes(env.setup, COUNT)
    told: list[Any] = []

    def noted(rows: Any) -> Any:
        (speeds,) = plan(episodes, rows)
        for row, speed in zip(rows.tolist(), speeds.tolist(), strict=True):
            off = np.abs(np.diff(episodes.arrays.angles[row]) - episodes.goals.turns[row])
            off = off if episodes.arrays.forward[row] else off[::-1]
            gone = float(episodes.chains.advances()[row]) / env.setup.scene.casing.diagonal
            told.append((row, int(episodes.stage[row]), off, gone, speed))
        return (speeds,)

    episodes.play(episode_seeds("drawing back test", COUNT), [number] * COUNT, noted)
    return told


def test_what_is_off_when_the_feed_has_stood_is_drawn_in(refolding: Any) -> None:
    found, told = refolding
    stood, steps, begun = np.zeros(COUNT), np.zeros(COUNT), 0
    for row, stage, off, gone, speed in told:
        steps[row] += 1
        if stage != FIRST:
            continue
        first, wrong = found[row].first, np.flatnonzero(off > SUCCESS_TOLERANCE)
        may = wrong.size and gone > max(wrong[0] + first.depth, drawing_back.LEAST)
        if stood[row] >= first.stands and may and steps[row] <= drawing_back.PATIENCE * HORIZON:
            assert speed == first.speed
            begun += 1
        stood[row] = stood[row] + 1 if speed == 0.0 else 0
    assert begun
    assert {stage for _, stage, *_ in told} == {FIRST, BACK, SECOND}


def test_a_first_fold_creeps_where_the_tube_holds_the_last_component(refolding: Any) -> None:
    found, _ = refolding
    scene = ReprogramEnv().setup.scene
    for each in found:
        *_, stand, creep, rest = each.first.first.way
        assert (stand.speed, rest.speed) == (0.0, 0.0)
        assert stand.steps < LONGEST_PAUSE < each.first.stands
        assert scene.n - 1 < creep.until / scene.casing.diagonal < scene.n
        assert creep.brakes
        assert each.back < 0.0


@pytest.mark.medium
def test_for_every_task_the_best_of_some_settings_is_found(tmp_path, monkeypatch):
    every: Any = make_env(SETTINGS).unwrapped
    few: Any = UnknownFloorEnv(tasks=every.tasks[8:10])
    for module in drawing_back, open_loops:
        monkeypatch.setattr(module, "make_env", lambda _: few)
    monkeypatch.setattr(open_loops.os, "sched_getaffinity", lambda _: {0})
    # Two candidates play the whole budget in one round.
    monkeypatch.setattr(drawing_back, "EFFORT", Search(2, 80))
    effort = Search(13, 39)
    found = drawing_back.searched(SETTINGS, effort, tmp_path)
    best = open_loops.best_open_loops(SETTINGS, effort, tmp_path)
    seeds = episode_seeds(drawing_back.STREAM, 40)
    pool = open_loops.pool_of(few)
    for number, one in enumerate(found):
        tried = drawing_back.candidates(best[number], number, 2)
        ends = [
            pool.play(np.full(40, number), seeds, lambda part, each=each: _plan(each, part))[:, 0]
            for each in tried
        ]
        assert one == tried[int(np.mean(ends, axis=1).argmax())]
    # What was searched is stored.
    monkeypatch.setattr(RolloutPool, "race", None)
    assert found == drawing_back.searched(SETTINGS, effort, tmp_path)


def _plan(found: drawing_back.Redoing, part: slice) -> drawing_back.DrawingBack:
    return drawing_back.DrawingBack([found] * len(range(*part.indices(40))))
