from itertools import islice

import pytest

from magfold_bench.lists.feed_tasks import find_two_folds
from magfold_bench.lists.tasks import LISTS, text_of
from magfold_env.envs.tasks.feed_tasks import (
    AnchorTask,
    FeedTask,
    RefoldTask,
    Task,
    TrayTask,
    read_tasks,
)
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


@pytest.mark.slow
def test_the_first_chain_found_is_a_shipped_one() -> None:
    shipped = read_tasks("two-folds-6")
    assert all(task in shipped for _, task in islice(find_two_folds(), 2))
