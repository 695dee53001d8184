"""The best open loops are shown, each where it succeeds, and searched once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.open_loops.search import Field, Search, open_loops_of
from agents.settings import EnvSettings
from agents.training import open_loops
from agents.training.envs import make_env
from agents.training.open_loops import STREAM, BestOpenLoops
from magfold_env.envs.unknown_floor import UnknownFloorEnv

SETTINGS = EnvSettings(id="MagFold/UnknownFloor-v0", actions="discrete", speeds=3)
EFFORT = Search(13, 39)
TASKS = 3


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Let there be few tasks, searched in this process; return their environment."""

    every: Any = make_env(SETTINGS).unwrapped
    env: Any = UnknownFloorEnv(tasks=every.tasks[:TASKS], actions="discrete", speeds=3)
    monkeypatch.setattr(open_loops, "make_env", lambda _: env)
    monkeypatch.setattr(open_loops.os, "sched_getaffinity", lambda _: {0})
    return env


@pytest.mark.medium
def test_an_episode_is_played_by_the_best_that_succeeds(few: Any, tmp_path: Path) -> None:
    best = BestOpenLoops(SETTINGS, EFFORT, tmp_path)
    numbers, seeds = np.arange(12) % TASKS, list(range(100, 112))
    loops = open_loops_of(few)
    field = Field(few.make_episodes(few.world, 12), loops, few.world.actions)
    ranked = [field.search(number, STREAM, EFFORT) for number in range(TASKS)]
    tried = [loops.candidates(EFFORT.candidates, number) for number in range(TASKS)]
    shown = field.play(numbers, seeds, lambda _: best.plan(numbers.tolist(), seeds))[:, 0]
    single = np.array(
        [
            [
                field.follow(numbers[[row]], [seed], [tried[number][each.place]])[0, 0]
                for each in ranked[number]
            ]
            for row, (number, seed) in enumerate(zip(numbers.tolist(), seeds, strict=True))
        ]
    )
    np.testing.assert_array_equal(shown, single.max(axis=1))
    assert 0.0 < single[:, 0].mean() < shown.mean()


@pytest.mark.medium
def test_a_search_goes_on_where_it_was_broken_off(
    few: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, searched = Field.search, list[int]()

    def search(field: Field, number: int, *given: Any) -> Any:
        if searched == [0]:
            searched.append(-1)
            raise KeyboardInterrupt
        searched.append(number)
        return own(field, number, *given)

    monkeypatch.setattr(Field, "search", search)
    with pytest.raises(KeyboardInterrupt):
        BestOpenLoops(SETTINGS, EFFORT, tmp_path)
    BestOpenLoops(SETTINGS, EFFORT, tmp_path)
    assert searched == [0, -1, 1, 2]
    BestOpenLoops(SETTINGS, EFFORT, tmp_path)
    assert len(searched) == 4
