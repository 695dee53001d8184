"""Tests that shipped policies are the trained ones, and that their cards contain their scores."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from agents.evaluate import compare
from agents.evaluation import policies
from agents.evaluation.episodes import Method
from agents.evaluation.report import summarise
from agents.evaluation.shipped import Card, CardError, load_shipped, shipped_files
from agents.ship import app, ship_policies, with_results
from agents.training import policy_files
from agents.training.run import train
from magfold_env.scoring.results import Results
from tests.agents.training import call, tiny

pytestmark = pytest.mark.train

NAME = "tiny-set"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folders = [tmp_path_factory.mktemp("run") for _ in range(2)]
    for seed, folder in enumerate(folders):
        train(tiny(seed=seed, timesteps=24), folder)
    return folders


@pytest.fixture
def card(runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Card:
    monkeypatch.setattr(policies, "policies_dir", lambda: tmp_path)
    return ship_policies(NAME, runs, tmp_path)


def test_policies_are_those_of_the_runs_and_loaded_by_their_name(card, runs, tmp_path):
    files = shipped_files(NAME)
    assert [file.name for file in files] == [policy.file for policy in card.policies]
    for run, file in zip(runs, files, strict=True):
        assert file.read_bytes() == (run / "policy.safetensors").read_bytes()
    assert [policy.run.seed for policy in card.policies] == [0, 1]
    assert Card.read(tmp_path / f"{NAME}.json") == card
    assert policy_files.load(shipped_files(NAME)[1]).steps == card.policies[1].run.steps
    load_shipped(NAME, 1)
    method = Method.parse(NAME)
    assert method == Method(NAME, tuple(map(str, shipped_files(NAME))))
    with pytest.raises(ValueError, match="number: 2 is not allowed; must be 0 to 1"):
        load_shipped(NAME, 2)
    with pytest.raises(ValueError, match=f"other: no such policies; must be one of {NAME}"):
        load_shipped("other")


@pytest.mark.medium
def test_the_card_takes_what_an_evaluation_and_an_ablation_found(card, tmp_path):
    settings = tiny().env
    results = compare([Method.parse(NAME)], settings, 3, 1, tmp_path / "out")
    card = with_results(card, [tmp_path / "out" / "results.json"])
    (found,) = card.results
    assert len(found.seeds) == 3
    assert found.tasks == tuple(dict.fromkeys(each.target for each in results[NAME][0]))
    for kept, run in zip(found.rows[NAME].runs, results[NAME], strict=True):
        assert kept.success == "".join(str(int(each.success)) for each in run)
    assert found.rows[NAME].success == summarise(results)[NAME].success
    assert found.env == settings.model_dump(mode="json", exclude_defaults=True)
    given = [NAME, "--draws", 1, "--processes", 1, "--seeds", 1, "--output", tmp_path]
    for change in ("fidelity=quasistatic", "components=3", "randomisation=null"):
        given += ["--env", change]
    call("ablate", *given, code=0)
    both = with_results(card, [tmp_path / "ablation.json"])
    assert both.of("evaluation") == [found]
    (ablation,) = both.of("ablation")
    assert ablation == Results.read(tmp_path / "ablation.json", "ablation")
    assert both.numbers(ablation.rows["seeing"]) == [0]
    assert ablation.env == found.env


@pytest.mark.medium
def test_an_admission_tells_what_cards_take(tmp_path: Path) -> None:
    floor = "MagFold/UnknownFloor-v0"
    train(tiny(env={"id": floor}, timesteps=24), tmp_path / "run")
    card = ship_policies(NAME, [tmp_path / "run"], tmp_path)
    given = [floor, "--policy", tmp_path / "run" / "policy.safetensors", "--tasks", 1]
    given += ["--episodes", 3, "--search", 13, 32, "--race", 13, 32, "--processes", 1]
    call("admission.__main__", *given, "--output", tmp_path, code=0)
    (found,) = with_results(card, [tmp_path / "admission.json"]).results
    assert (found.id, card.numbers(found.rows["trained"])) == (floor, [0])
    (run,) = found.rows["trained"].runs
    assert len(run.success) == 3
    assert found.rows["trained"].success[0] == pytest.approx(run.success.count("1") / 3)
    compare([], tiny().env, 1, 1, tmp_path / "out")
    text = (tmp_path / "admission.json").read_text(encoding="utf-8")
    other = tmp_path / "other.json"
    other.write_text(text.replace(card.policies[0].sha256, "0" * 64), encoding="utf-8")
    for file in (other, tmp_path / "out" / "results.json"):
        with pytest.raises(CardError, match=r"\.json: has no results of all of tiny-set"):
            with_results(card, [file])


@pytest.mark.parametrize("damage", ["card", "policy"])
def test_what_is_damaged_is_refused(card: Card, tmp_path: Path, damage: str) -> None:
    path = tmp_path / (f"{NAME}.json" if damage == "card" else card.policies[0].file)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(CardError, match=f"{NAME}.json: "):
        load_shipped(NAME)


def test_runs_of_other_settings_make_no_set(runs, tmp_path_factory, tmp_path):
    other = tmp_path_factory.mktemp("other")
    train(tiny(timesteps=24, learner={"algorithm": "ppo", "n_steps": 24, "batch_size": 24}), other)
    with pytest.raises(CardError, match="was trained with settings other than"):
        ship_policies(NAME, [runs[0], other], tmp_path)
    with pytest.raises(CardError, match="is not the folder of a finished training run"):
        ship_policies(NAME, [tmp_path], tmp_path)


def test_the_command_ships_and_tells_what_is_wrong(runs: list[Path], tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["policies", NAME, str(runs[0]), "--folder", str(tmp_path)])
    assert done.exit_code == 0, done.stderr
    wrong = tmp_path / "results.json"
    wrong.write_text(json.dumps({}), encoding="utf-8")
    refused = CliRunner().invoke(app, ["results", NAME, str(wrong), "--folder", str(tmp_path)])
    assert refused.exit_code == 2
    assert "has no results of all of tiny-set" in refused.stderr
