"""The best open loops of a task are searched once."""

from pathlib import Path
from typing import Any

import pytest

from agents.open_loops.search import Field, Search
from agents.settings import EnvSettings
from agents.training import open_loops
from agents.training.envs import make_env
from agents.training.open_loops import best_open_loops
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
        best_open_loops(SETTINGS, EFFORT, tmp_path)
    best_open_loops(SETTINGS, EFFORT, tmp_path)
    assert searched == [0, -1, 1, 2]
    best_open_loops(SETTINGS, EFFORT, tmp_path)
    assert len(searched) == 4
