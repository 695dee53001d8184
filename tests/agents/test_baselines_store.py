from pathlib import Path

import pytest

from agents.baselines import searches
from agents.baselines.searches import choose
from agents.evaluation.policies import ChoiceFile, Chosen, read_choices
from agents.settings import EnvSettings

SETTINGS = EnvSettings(targets=("LRLLL", "RLRRR"))
KEY = {"search": "cross-entropy", "budget": 10}


def chosen(speed: float) -> Chosen:
    return Chosen(("NSNS",) * 6, (speed,) * 6, calls=10, successes=3, releases=4)


def test_choices_survive_a_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "choices.json"
    ChoiceFile(path, KEY).add("LRLLL", chosen(0.1))
    again = ChoiceFile(path, KEY)
    assert again.chosen == {"LRLLL": chosen(0.1)}
    again.add("RLRRR", chosen(0.2))
    assert read_choices(path) == {"LRLLL": chosen(0.1).choice, "RLRRR": chosen(0.2).choice}


def test_choices_of_another_search_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "choices.json"
    ChoiceFile(path, KEY).add("LRLLL", chosen(0.1))
    with pytest.raises(ValueError, match="another search, with budget 10; must be 20"):
        ChoiceFile(path, KEY | {"budget": 20})


@pytest.mark.parametrize("text", ["", "[]", '{"format": "other"}', '{"checksum": 1}'])
def test_foreign_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "choices.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"choices\.json: holds no choices .* or is damaged"):
        read_choices(path)


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "choices.json"
    ChoiceFile(path, KEY).add("LRLLL", chosen(0.1))
    path.write_text(path.read_text(encoding="utf-8").replace("0.1", "0.2"), encoding="utf-8")
    with pytest.raises(ValueError, match="damaged"):
        ChoiceFile(path, KEY)


def test_a_search_that_was_stopped_goes_on_with_the_next_target(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "choices.json"
    whole = dict(choose("cross-entropy", SETTINGS, tmp_path / "whole.json", budget=3))
    next(choose("cross-entropy", SETTINGS, path, budget=3))
    searched: list[str] = []
    search = searches._search  # pyright: ignore[reportPrivateUsage]

    def noted(name, settings, target, *rest):
        searched.append(target)
        return search(name, settings, target, *rest)

    monkeypatch.setattr(searches, "_search", noted)
    assert dict(choose("cross-entropy", SETTINGS, path, budget=3)) == whole
    assert searched == ["RLRRR"]
    with pytest.raises(ValueError, match="with seed 0; must be 1"):
        list(choose("cross-entropy", SETTINGS, path, budget=3, seed=1))
