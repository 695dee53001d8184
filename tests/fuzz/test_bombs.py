"""A small file that stands for a huge one is refused at once."""

import time

import pytest

from agents.settings import SettingsError, load_settings
from agents.tune import load_search
from tests.command_line import fails_in_one_line, run
from tests.fuzz.readers import READERS, outcome

BOMB = "a0: &a0 [x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 20)
)
"""Lists of nine lists each, twenty deep: 1.1 kB that stands for 10¹⁸ entries."""

REFUSED = "line 2, column 10: the alias *a0 is not allowed; must be what it stands for, in full"


@pytest.fixture(autouse=True)
def _at_once():
    begun = time.monotonic()
    yield
    assert time.monotonic() - begun < 2.0


@pytest.mark.parametrize("name", [name for name, each in READERS.items() if each.suffix == ".yaml"])
def test_files_of_yaml_have_no_aliases(name: str) -> None:
    assert outcome(READERS[name], BOMB.encode()).endswith(f"given.yaml: {REFUSED}")


def test_the_command_line_says_so_in_one_line(tmp_path) -> None:
    path = tmp_path / "bomb.yaml"
    path.write_text(BOMB, encoding="utf-8")
    fails_in_one_line(run("fold", path), f"bomb.yaml: {REFUSED}")


def test_searches_and_assignments_have_none_either(tmp_path) -> None:
    path = tmp_path / "bomb.yaml"
    path.write_text(BOMB, encoding="utf-8")
    with pytest.raises(SettingsError, match=r"bomb\.yaml: line 2, column 10: the alias"):
        load_search(str(path))
    with pytest.raises(SettingsError, match=r"its value: line 1, column 11: the alias \*a is not"):
        load_settings("ppo-tube-feed", ["env.targets=[&a [LR], *a]"])
