import json
from collections import Counter
from itertools import islice
from typing import Any

import numpy as np
import pytest

from magfold_bench.lists.baselines import TRACKS, store_of_v0
from magfold_bench.lists.feed_tasks import find_two_folds, random_chains, random_faces
from magfold_bench.lists.tasks import LISTS, in_turn_by_side, text_of
from magfold_env.envs.tasks.feed_tasks import (
    AnchorTask,
    FeedTask,
    RefoldTask,
    Task,
    TrayTask,
    read_tasks,
)
from magfold_env.envs.tasks.symmetry import SIDES, Side, side_of
from magfold_env.files import configs_dir

KINDS: dict[str, type[Task]] = {
    "two-folds-6": FeedTask, "chamber-6": FeedTask, "two-words-6": RefoldTask, "trays-6": TrayTask,
    "anchors-6": AnchorTask,
}  # fmt: skip


@pytest.mark.parametrize("name", LISTS)
def test_shipped_lists_are_what_is_written(name: str) -> None:
    path = configs_dir() / "tasks" / f"{name}.yaml"
    written = path.read_text(encoding="utf-8")
    ends = [line.rpartition("# ")[2] for line in written.splitlines() if line.startswith("-")]
    found = zip(
        [float(end) if "." in end else int(end) for end in ends],
        read_tasks(name, KINDS[name]),
        strict=True,
    )
    assert text_of(name, list(found)) == written


@pytest.mark.parametrize("side", SIDES)
def test_a_search_on_one_side_finds_that_side_only(side: Side) -> None:
    chains = random_chains(np.random.default_rng(1), 20, side)
    assert [side_of(chain) for chain in chains] == [side] * 20


def test_a_search_on_both_sides_tries_the_chains_of_shipped_lists() -> None:
    tried = random_chains(np.random.default_rng(1), 250, None)
    assert tried == random_faces(np.random.default_rng(1), (250, 6))


def test_blocks_take_both_directions_on_both_sides() -> None:
    def find(direction: str, seed: int, side: Side) -> Any:
        return iter([(direction, side)])

    found = Counter(next(in_turn_by_side(find, seed)) for seed in range(1000, 1010))
    each = {"train": 3, "test": 2}
    assert found == {(d, side): each[side] for d in ("forward", "backward") for side in SIDES}


@pytest.mark.parametrize("kind", TRACKS)
def test_shipped_baselines_are_those_of_the_tasks_of_v0(kind: Any) -> None:
    path = configs_dir() / "baselines" / f"{kind.default_scene}.json"
    shipped = json.loads(path.read_text(encoding="utf-8"))
    store = store_of_v0(kind)
    assert store.key == shipped["key"]
    assert len(store.names) == len(shipped["baselines"])


@pytest.mark.slow
def test_the_first_chain_found_is_a_shipped_one() -> None:
    shipped = read_tasks("two-folds-6")
    assert all(task in shipped for _, task in islice(find_two_folds(), 2))
