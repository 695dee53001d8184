import json
from pathlib import Path

import pytest

from agents.generalise import deal, summary
from agents.settings import load_settings, save_settings
from magfold_env.shapes import folded_words, mirror
from tests.agents.training import call, tiny

WORDS = list(folded_words(5))


def test_every_word_is_held_out_once() -> None:
    dealt = deal(WORDS, 5)
    assert sorted(word for fold in dealt for word in fold) == sorted(WORDS)
    assert max(map(len, dealt)) - min(map(len, dealt)) <= 2
    assert all({mirror(word) for word in fold} == set(fold) for fold in dealt)
    assert deal(WORDS, 5) == dealt


def test_what_is_lost_is_taken_word_by_word() -> None:
    held = {"LL": 0.5, "LR": 1.0, "LS": 0.9, "SL": 0.0}
    seen = [{"LS": 1.0, "SL": 0.6}, {"LL": 0.7, "LR": 1.0}]
    rows = summary(held, seen, {"LL": 0.0, "LR": 1.0, "LS": 1.0, "SL": 0.0})
    values = {name: each.value for name, each in rows.items()}
    expected = {"held out": 0.6, "seen": 0.825, "lost": 0.225, "ahead of it, held out": 0.1}
    assert {name: values[name] for name in expected} == pytest.approx(expected)
    assert 0.0 <= rows["lost"].low < 0.225 < rows["lost"].high <= 0.6


@pytest.mark.medium
def test_the_command_trains_plays_and_goes_on(tmp_path: Path) -> None:
    settings = tiny(env={"fidelity": "quasistatic"}, timesteps=48, validation_episodes=2)
    save_settings(settings, tmp_path / "tiny.yaml")
    options = "--components 4 --folds 2 --draws 2 --processes 1 --against random --output"
    given = [tmp_path / "tiny.yaml", *options.split(), tmp_path / "runs"]
    call("generalise", *given, code=0)
    trained = (tmp_path / "runs" / "fold-1" / "policy.safetensors").stat().st_mtime_ns
    content = json.loads((tmp_path / "runs" / "generalise.json").read_text(encoding="utf-8"))
    held = [word for fold in content["figures"]["folds"] for word in fold["held"]]
    assert sorted(held) == sorted(folded_words(4))
    for k, fold in enumerate(content["figures"]["folds"]):
        settings = load_settings(tmp_path / "runs" / f"fold-{k}" / "settings.yaml")
        assert set(settings.env.targets or ()) == set(held) - set(fold["held"]) == set(fold["seen"])
        assert settings.seed == k
    assert set(content["figures"]["other"]) == set(held)
    call("generalise", *given, code=0)
    assert (tmp_path / "runs" / "fold-1" / "policy.safetensors").stat().st_mtime_ns == trained
