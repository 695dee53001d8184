import json
import re
from pathlib import Path

import numpy as np
import pytest

from agents.evaluate import compare
from agents.evaluation.episodes import Method, Outcome, make_env, play
from agents.evaluation.policies import ChoiceFile, Chosen, designs
from agents.evaluation.report import Played, summarise
from agents.settings import EnvSettings, env_settings, load_settings
from magfold_env.simulation.simulate import simulate
from tests.agents.training import call
from tests.markup import Markup

SETTINGS = EnvSettings(targets=("LRLLL", "RLRRR"))
FLOOR = ("MagFold/UnknownFloor-v0", "--output", "{path}")
TWICE = ("--set", "seed=1", "--set", "seed=2")
SHORT = ("--env", "components=3", "--env", "targets=[LR, RL]")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("comparison")


@pytest.fixture(scope="module")
def results(folder: Path) -> Played:
    """Return results of two seeds of a method, whose choices differ, and of the baselines."""
    for k, faces in enumerate(("NSNS", "NNSS")):
        file = ChoiceFile(folder / f"{k}.json", {})
        for target in SETTINGS.targets or ():
            file.add(target, Chosen((faces,) * 6, (0.1,) * 6, 0, 0, 0))
    frozen = Method("frozen", (str(folder / "0.json"), str(folder / "1.json")))
    return compare([frozen], SETTINGS, draws=2, processes=1, folder=folder, built=True)


@pytest.mark.medium
def test_the_comparison_writes_numbers_and_a_page_that_needs_nothing_but_itself(folder, results):
    assert {name: len(runs) for name, runs in results.items()} == {
        "frozen": 2, "random": 1, "minimiser": 1,
    }  # fmt: skip
    assert all(len(run) == 4 for runs in results.values() for run in runs)
    content = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert content["rows"]["minimiser"]["success"][0] == 1.0
    text = (folder / "report.html").read_text(encoding="utf-8")
    page = Markup(text)
    assert page.addresses
    assert all(link.startswith(("data:", "#")) for link in page.addresses)
    assert len(page.frames) >= 2 * len(results)
    assert all("</html>" in fold and "<script" in fold for fold in page.frames)
    # The answer comes first. Of all that is folded away, only the first fold is open.
    answer = summarise(results)["frozen"]
    said = text.index(f"frozen reaches its target in {answer.success} of 8 episodes")
    assert said < text.index("Contents") < text.index("<table")
    shown = [text.index(name) for name in re.findall(r"<summary>(?:frozen|random|minimiser)", text)]
    assert shown == sorted(shown)
    assert text.count('name="folds" open') == 1
    assert text.index("<summary>frozen") < text.index('name="folds" open') < shown[1]
    assert str(Path.cwd()) not in text


@pytest.mark.medium
def test_policies_and_chains_built_beforehand_have_the_same_draws(results: Played) -> None:
    scenes = [[each.scene for each in run] for runs in results.values() for run in runs]
    for same in zip(*scenes, strict=True):
        assert len({(scene.friction, scene.start_angles) for scene in same if scene}) == 1
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


def test_a_chain_that_is_not_simulated_has_no_motion_to_show(tmp_path, capsys):
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


TRACK = "; magfold score plays the policies of "


@pytest.mark.parametrize(("module", "arguments", "said"), [
    ("train", ["no-such"], "no-such: no such file; "),
    ("evaluate", ["--config", "no-such"], "no-such: no such file; "),
    ("evaluate", ["no-such"], "no-such: no such file; "),
    ("baselines", ["robust", "--config", "no-such"], "no-such: no such file; "),
    ("baselines", ["robst"], "search: 'robst' is not allowed"),
    ("admission.__main__", ["MagFold/TubeFeed-v0"], "id: 'MagFold/TubeFeed-v0' is not allowed"),
    ("admission.__main__", [*FLOOR, "--search", "1000", "900"], "budget: 900 is not allowed"),
    ("admission.__main__", [*FLOOR, "--race", "1001", "9000"], "--race: 1001 open loops are "),
    ("admission.__main__", [*FLOOR, "--blind", "no.safetensors"], "no.safetensors: no such "),
    ("evaluate", ["ppo-tube-fed"], "did you mean ppo-tube-feed?"),
    ("ablate", ["ppo-tube-fed"], "did you mean ppo-tube-feed?"),
    ("evaluate", ["--env", "colour=red"], "env.colour: 'red' is not allowed; unknown key"),
    ("evaluate", ["ppo-lumen"], "ppo-lumen-0: policy: its spaces"),
    ("evaluate", ["ppo-lumen"], TRACK),
    ("ablate", ["random", "--env", "id=MagFold/SequenceDesign-v0"], "env.id: 'MagFold/Seque"),
    ("evaluate", ["--config", "ppo-lumen"], "env.id: 'MagFold/Lumen-v0' is not allowed;"),
    ("evaluate", ["--config", "ppo-tray"], TRACK),
    ("evaluate", ["{path}", *SHORT], "{path}: target: 'RL' has no choice; must be one of LR"),
    ("evaluate", ["ppo-tube-feed", *SHORT], "ppo-tube-feed-0: policy: its spaces"),
    ("ablate", ["ppo-tube-feed", *SHORT], "ppo-tube-feed-0: policy: its spaces"),
    ("evaluate", ["--output", "{path}"], "--output: '{path}' is not allowed"),
    ("ablate", ["random", "--output", "{path}"], "--output: '{path}' is not allowed"),
    ("generalise", ["--output", "{path}"], "--output: '{path}' is not allowed"),
    ("train", ["ppo-tube-feed", *TWICE], "--set: 'seed=2' is not allowed; must not name seed a"),
    ("tune", ["ppo-tube-feed", *TWICE], "--set: 'seed=2' is not allowed; must not name seed a"),
    ("evaluate", [*SHORT, *SHORT], "--env: 'components=3' is not allowed; must not name"),
    ("generalise", ["--set", "learner.algorithm=dqn"], "its algorithm must be one of"),
    ("generalise", ["--components=3", "--folds=2", "--against={path}"], "{path}: target: "),
])  # fmt: skip
def test_what_is_wrong_is_told_in_a_line_before_anything_begins(module, arguments, said, tmp_path):
    choice = Chosen(("NSNS", "SN-N", "NSNS"), (0.1,) * 3, calls=0, successes=0, releases=0)
    path = tmp_path / "choices.json"
    ChoiceFile(path, {}).add("LR", choice)
    result = call(module, *(each.format(path=path) for each in arguments))
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert result.stderr.startswith("error: ")
    assert said.format(path=path) in result.stderr
    assert result.stderr.count("\n") == 1
