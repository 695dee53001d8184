"""Tests that slightly wrong files and values are read, or cause errors that name them."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import magfold_env as mf
from agents.settings import SettingsError, load_settings
from agents.tune import load_search
from magfold_env.envs.tasks.feed_tasks import read_tasks
from magfold_env.envs.tasks.targets import resolve_targets
from tests.command_line import fails_in_one_line, run
from tests.fuzz.mutations import VALUES, mutated
from tests.fuzz.readers import READERS, outcome

patient = settings(suppress_health_check=[HealthCheck.too_slow])


@cache
def whole(name: str) -> list[bytes]:
    return READERS[name].whole()


@pytest.mark.parametrize("name", READERS)
def test_whole_files_are_read(name: str) -> None:
    for content in whole(name):
        assert outcome(READERS[name], content) == ""


@pytest.mark.parametrize("name", READERS)
@patient
@given(data=st.data())
def test_what_is_next_to_right_is_read_or_refused_clearly(name: str, data: st.DataObject) -> None:
    reader = READERS[name]
    content = data.draw(mutated(whole(name), reader.suffix))
    outcome(reader, reader.signed(content))


@patient
@given(
    st.dictionaries(st.sampled_from(sorted(mf.Scene.model_fields)) | st.text(max_size=3), VALUES)
)
def test_scenes_of_any_values_are_made_or_refused(values: dict[str, Any]) -> None:
    try:
        mf.Scene(**{"sequence": ("NSNS",) * 3, **values})
    except mf.SceneError as error:
        assert str(error)  # noqa: PT017


@patient
@given(VALUES)
def test_targets_of_any_kind_are_taken_or_refused(value: Any) -> None:
    for read in (lambda: resolve_targets(value, 3), lambda: read_tasks(value)):
        try:
            read()
        except ValueError as error:
            assert "must" in str(error)  # noqa: PT017


BOMB = "a0: &a0 [x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 20)
)
"""Lists of nine lists each, twenty levels deep: 1.1 kB that represent 10¹⁸ entries."""

REFUSED = "line 2, column 10: the alias *a0 is not allowed; must be what it stands for, in full"


def test_a_small_file_that_stands_for_a_huge_one_is_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "bomb.yaml"
    path.write_text(BOMB, encoding="utf-8")
    for reader in READERS.values():
        if reader.suffix == ".yaml":
            assert outcome(reader, BOMB.encode()).endswith(f"given.yaml: {REFUSED}")
    fails_in_one_line(run("fold", path), f"bomb.yaml: {REFUSED}")
    with pytest.raises(SettingsError, match=r"bomb\.yaml: line 2, column 10: the alias"):
        load_search(str(path))
    with pytest.raises(SettingsError, match=r"its value: line 1, column 11: the alias \*a is not"):
        load_settings("ppo-tube-feed", ["env.targets=[&a [LR], *a]"])
