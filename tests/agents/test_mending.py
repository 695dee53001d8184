"""Tests of plans that rebuild failed chains from their trays, and so hold more often."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.settings import EnvSettings
from agents.training import mending
from agents.training.envs import make_env
from agents.training.imitation import Demonstrations
from agents.training.mending import CHAINS, Mending, mended
from magfold_env.envs.episodes import Episodes
from magfold_env.envs.spaces.actions import AHEAD, BACK, LYING, PATTERNS, PULL
from magfold_env.envs.tasks.draws import episode_seeds
from tests.agents.training import tiny

ANCHOR = "MagFold/Anchor-v0"
DRAWS = 24
SETTINGS = EnvSettings(id=ANCHOR, difficulty=0.1)


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    folder = tmp_path_factory.mktemp("mending")
    return folder, mended(SETTINGS, folder, DRAWS)


@pytest.fixture(scope="module")
def found(searched: Any) -> tuple[Any, Any]:
    return make_env(SETTINGS).unwrapped, searched[1]


def play(env: Any, ways: Any, stream: str) -> tuple[Any, list[list[tuple[int, ...]]]]:
    """Return results of episodes of task 0, and the direction, feed and pull of each step."""
    episodes = env.make_episodes(env.setup, DRAWS)
    plan, took = Mending([ways] * DRAWS), [[] for _ in range(DRAWS)]

    def choose(rows: Any) -> Any:
        before = episodes.arrays.fed[rows], episodes.borne(rows)
        choice = plan(episodes, rows)
        for row, *each in zip(rows.tolist(), choice[3], *before, strict=True):
            took[row].append(tuple(each))
        return choice

    return episodes.play(episode_seeds(stream, DRAWS), [0] * DRAWS, choose), took


@pytest.mark.slow
def test_chains_can_be_had_from_their_trays_and_are_searched_once(searched, found, monkeypatch):
    env, ways = found
    monkeypatch.setattr(Episodes, "play", None)
    assert mended(SETTINGS, searched[0], DRAWS) == ways
    assert len(ways) == len(env.tasks)
    for task, chains in zip(env.tasks, ways, strict=True):
        assert 1 <= len(chains) <= CHAINS
        assert len({chain.fed[0] for chain in chains}) == 1
        assert len({chain.fed for chain in chains}) == len(chains)
        for chain in chains:
            parts, lies = zip(*chain.fed, strict=True)
            assert len(set(parts)) == task.n
            patterns = [PATTERNS.index(task.tray[part]) for part in parts]
            assert np.isin(LYING[patterns, lies], np.arange(16)).all()
            assert chain.speed in env.actions.speeds


@pytest.mark.slow
def test_chains_that_fail_a_test_are_drawn_back_and_more_hold_in_the_end(found: Any) -> None:
    env, ways = found
    one, others = play(env, ways[0][:1], mending.STREAM)
    ends, took = play(env, ways[0], mending.STREAM)
    assert ends["is_success"].sum() > one["is_success"].sum()
    assert all(BACK not in [step[0] for step in steps] for steps in others)
    for success, steps in zip(one["is_success"], took, strict=True):
        way = [step[0] for step in steps]
        first = way.index(PULL)
        assert way[:first] == [AHEAD] * env.setup.scene.n
        if success:  # it is left at once
            assert way[first + 1 :] == [AHEAD]
        elif BACK in way and AHEAD in way[first:]:
            last = way.index(AHEAD, first) - 1
            assert steps[last][:2] == (BACK, 2)  # all but the first component
    assert any(BACK in [step[0] for step in steps] for steps in took)


@pytest.mark.slow
def test_demonstrations_can_show_it(found, monkeypatch, tmp_path):
    _, ways = found
    monkeypatch.setattr("agents.training.imitation.mended", lambda *_: ways)
    given = tiny(env={"id": ANCHOR, "difficulty": 0.1}, imitate={"plan": "mending", "random": 0.0})
    steps = Demonstrations(given, tmp_path).block(range(8))
    assert {BACK, PULL} <= set(steps.actions[:, 3].tolist())
