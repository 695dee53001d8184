import importlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from agents.evaluate import compare, evaluate
from agents.evaluation.episodes import Method, Outcome, make_env, play
from agents.evaluation.policies import ChoiceFile, Chosen, designs
from agents.evaluation.report import Played, summarise
from agents.settings import EnvSettings, env_settings, load_settings
from magfold_env.simulation.simulate import simulate

runner = CliRunner()

SETTINGS = EnvSettings(targets=("LRLLL", "RLRRR"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("comparison")


@pytest.fixture(scope="module")
def results(folder: Path) -> Played:
    """Two seeds of one method, whose choices differ, beside those always compared with."""
    for k, faces in enumerate(("NSNS", "NNSS")):
        file = ChoiceFile(folder / f"{k}.json", {})
        for target in SETTINGS.targets or ():
            file.add(target, Chosen((faces,) * 6, (0.1,) * 6, 0, 0, 0))
    frozen = Method("frozen", (str(folder / "0.json"), str(folder / "1.json")))
    return compare([frozen], SETTINGS, draws=2, processes=1, folder=folder, built=True)


@pytest.mark.medium
def test_the_comparison_writes_numbers_and_pictures(folder: Path, results: Played) -> None:
    assert {name: len(runs) for name, runs in results.items()} == {
        "random": 1,
        "minimiser": 1,
        "frozen": 2,
    }
    assert all(len(run) == 4 for runs in results.values() for run in runs)
    content = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert content["rows"]["minimiser"]["success"][0] == 1.0
    for name in ("overall", "targets", "reasons"):
        with Image.open(folder / f"{name}.png") as picture:
            assert min(picture.size) > 150


class Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.folds: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("src", "href")]
        self.folds += [value or "" for name, value in attrs if name == "srcdoc"]


@pytest.mark.medium
def test_the_page_needs_nothing_but_itself(folder: Path, results: Played) -> None:
    text = (folder / "report.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    assert page.links
    assert all(link.startswith(("data:", "#")) for link in page.links)
    assert page.tags.count("img") == 3
    assert "script" not in page.tags
    assert len(page.folds) >= 2 * len(results)
    assert all("</html>" in fold and "<script" in fold for fold in page.folds)
    for name in results:
        assert name in text


@pytest.mark.medium
def test_the_page_answers_first_and_opens_on_what_was_asked_about(
    folder: Path, results: Played
) -> None:
    assert list(results) == ["frozen", "random", "minimiser"]
    text = (folder / "report.html").read_text(encoding="utf-8")
    answer = summarise(results)["frozen"]
    said = text.index(f"frozen reaches its target in {answer.success} of 8 episodes")
    assert said < text.index("Contents") < text.index("<table")
    # Of all that is folded away, the first fold of the first method alone is not.
    shown = [text.index(name) for name in re.findall(r"<summary>(?:frozen|random|minimiser)", text)]
    assert shown == sorted(shown)
    assert text.count('name="folds" open') == 1
    assert text.index("<summary>frozen") < text.index('name="folds" open') < shown[1]
    assert str(Path.cwd()) not in text


@pytest.mark.medium
def test_policies_are_compared_on_the_same_draws(results: Played) -> None:
    scenes = [[each.scene for each in run] for runs in results.values() for run in runs]
    for same in zip(*scenes, strict=True):
        assert len({(scene.friction, scene.start_angles) for scene in same if scene}) == 1


@pytest.mark.medium
def test_a_choice_is_tried_built_beforehand_under_the_same_draws(results: Played) -> None:
    outcomes = [each for runs in results.values() for run in runs for each in run]
    for outcome in outcomes:
        assert outcome.scene is not None
        built = simulate(outcome.scene.replace(feed={"loading": "preloaded"}))
        assert outcome.built == (built.status == "folded" and built.word == outcome.target)
    assert {outcome.built for outcome in outcomes} == {True, False}


def test_an_outcome_says_what_was_asked_for_and_where_the_joints_are() -> None:
    env = make_env(SETTINGS)
    outcome: Outcome = play(designs, env, "LRLLL", 0)
    baseline = env.baseline_of("LRLLL")
    assert outcome.choice is not None
    assert outcome.scene is not None
    assert outcome.choice.sequence == outcome.scene.sequence == baseline.sequence
    assert set(outcome.choice.speeds) <= set(env.actions.speeds.tolist())
    assert outcome.scene.speeds == pytest.approx(np.full(6, baseline.speed), rel=0.05)
    assert outcome.joints == tuple(simulate(outcome.scene).joint_angles.tolist())
    assert outcome.reward == pytest.approx(outcome.score - baseline.score)


def test_nothing_is_built_beforehand_unless_asked_for() -> None:
    runs = evaluate([Method("random", ("random",))], SETTINGS, draws=1, processes=1)["random"]
    assert {each.built for each in runs[0]} == {None}


def test_a_chain_that_is_not_simulated_has_no_motion_to_show(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = EnvSettings(fidelity="quasistatic", components=4)
    results = compare([], settings, draws=1, processes=1, folder=tmp_path, built=True)
    assert list(results) == ["random"]  # the minimiser would be compared with itself
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "no motion to show" in text
    played = (
        "MagFold/TubeFeed-v0, randomisation nominal, components 4, fidelity quasistatic; 1 draw"
    )
    assert capsys.readouterr().out.startswith(played)
    assert played in text
    assert results["random"][0][0].built is None


def test_rewards_are_the_environments_own() -> None:
    assert load_settings("ppo-tube-feed").env.reward == "score"
    assert env_settings("ppo-tube-feed", []).reward is None
    assert env_settings("ppo-tube-feed", ["reward=sparse"]).reward == "sparse"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("strong", "'env.strong' is not allowed; must be a key and a value"),
        ("randomisation=wild", "env.randomisation: 'wild' is not allowed"),
        ("speeds=1", "env.speeds: 1 is not allowed"),
        (
            "id=MagFold/UnknownFloor-v0",
            "env.id: 'MagFold/UnknownFloor-v0' is not allowed",
        ),
        ("colour=red", "env.colour: 'red' is not allowed; unknown key"),
    ],
)
def test_a_wrong_change_is_named(change: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        env_settings("ppo-tube-feed", [change])


@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("train", ["no-such"]),
        ("evaluate", ["--config", "no-such"]),
        ("evaluate", ["no-such"]),
        ("baselines.__main__", ["robust", "--config", "no-such"]),
    ],
)
def test_a_wrong_name_ends_with_a_message_and_not_a_traceback(
    module: str, arguments: list[str]
) -> None:
    app = typer.Typer()
    app.command()(importlib.import_module(f"agents.{module}").main)
    result = runner.invoke(app, arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: no-such: no such file; ")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("module", ["evaluate", "ablate"])
def test_a_name_that_is_nearly_right_is_told_what_may_be_meant(module: str) -> None:
    app = typer.Typer()
    app.command()(importlib.import_module(f"agents.{module}").main)
    result = runner.invoke(app, ["ppo-tube-fed"])
    assert result.exit_code == 2
    assert all(name in result.stderr for name in ("ppo-floor-8, ", "did you mean ppo-tube-feed?"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["ppo-lumen"], "ppo-lumen-0: policy: its spaces"),
        (["--config", "ppo-lumen"], "env.id: 'MagFold/Lumen-v0' is not allowed; must be one in"),
        (["--config", "ppo-tray"], "env.id: 'MagFold/Tray-v0' is not allowed; must be one in"),
    ],
)
def test_who_plays_policies_of_tracks_is_told(arguments: list[str], said: str) -> None:
    app = typer.Typer()
    app.command()(importlib.import_module("agents.evaluate").main)
    result = runner.invoke(app, arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"error: {said}")
    assert "; magfold score plays the policies of " in result.stderr


def test_what_a_policy_cannot_play_is_told_before_anything_begins(tmp_path: Path) -> None:
    choice = Chosen(("NSNS", "SN-N", "NSNS"), (0.1,) * 3, calls=0, successes=0, releases=0)
    path = tmp_path / "choices.json"
    ChoiceFile(path, {}).add("LR", choice)
    given = ["--env", "components=3", "--env", "targets=[LR, RL]", "--output", str(tmp_path)]
    for module, arguments, said in (
        ("evaluate", [str(path)], f"{path}: target: 'RL' has no choice; must be one of LR"),
        ("evaluate", ["ppo-tube-feed"], "ppo-tube-feed-0: policy: its spaces"),
        ("ablate", ["ppo-tube-feed"], "ppo-tube-feed-0: policy: its spaces"),
        ("baselines.__main__", ["robst"], "search: 'robst' is not allowed"),
        ("evaluate", ["--output", str(path)], f"--output: '{path}' is not allowed"),
        ("generalise", [], f"{path}: target: "),
    ):
        own = [*given, *arguments]
        if module == "generalise":
            own = ["--components", "3", "--folds", "2", "--against", str(path)]
        app = typer.Typer()
        app.command()(importlib.import_module(f"agents.{module}").main)
        result = runner.invoke(app, own)
        assert (result.exit_code, result.stdout) == (2, ""), result.output
        assert result.stderr.startswith(f"error: {said}")
        assert result.stderr.count("\n") == 1
