"""Tests of searches for baselines: their budgets, their stored choices, and how they resume."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.baselines import SEARCHES, Calls, SpentError, Tally, choose, choose_for
from agents.evaluation.episodes import play
from agents.evaluation.policies import ChoiceFile, Chosen, OpenLoop, at_random, read_choices
from agents.evaluation.policies import chosen as choosing
from agents.settings import EnvSettings
from magfold_env.designer import gap_designs
from magfold_env.envs.episodes import Episodes
from magfold_env.envs.sequence_design import SequenceDesignEnv
from magfold_env.envs.tasks.draws import evaluation_seeds
from magfold_env.envs.tube_feed import TubeFeedEnv

TARGET = "LRL"
GOOD = ("NSSN", "NSNS", "SNNS", "SNSN")


@pytest.fixture(scope="module")
def lattice() -> TubeFeedEnv:
    return TubeFeedEnv(components=4, fidelity="quasistatic")


@pytest.fixture
def seeds(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Record the draws of every played episode."""
    found: list[int] = []
    own_play = Episodes.play

    def noted(episodes: Any, seeds: Sequence[int], *given: Any) -> Any:
        found.extend(seeds)
        return own_play(episodes, seeds, *given)

    monkeypatch.setattr(Episodes, "play", noted)
    return found


@pytest.fixture(scope="module")
def chain() -> TubeFeedEnv:
    return TubeFeedEnv(components=4, baseline=None)


@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_finds_the_target_within_its_budget(name, lattice, seeds):
    chosen = choose_for(name, 1.0, lattice, TARGET, 600, seed=0)
    assert chosen.calls == len(seeds) <= 600
    assert chosen.successes == chosen.releases > 0
    assert play(choosing({TARGET: OpenLoop(*chosen[:2])}), lattice, TARGET, 1).success


@pytest.mark.parametrize("name", SEARCHES)
@pytest.mark.parametrize("budget", [1, 3, 10])
def test_no_search_makes_a_call_too_many(name, budget, lattice, seeds):
    chosen = choose_for(name, 1.0, lattice, TARGET, budget, seed=0)
    assert chosen.calls == len(seeds) <= budget
    assert 0 < chosen.releases <= budget


def test_the_seed_decides_a_search(chain: TubeFeedEnv) -> None:
    choices = [choose_for("cross-entropy", 1.0, chain, TARGET, 50, seed) for seed in (1, 2, 1)]
    assert choices[0] == choices[2] != choices[1]


def test_the_minimisers_free_design_is_the_one_of_largest_gap(lattice: TubeFeedEnv) -> None:
    design = gap_designs(lattice.scene, [TARGET])[TARGET]  # pyright: ignore[reportArgumentType]
    chosen = choose_for("minimiser-free", 1.0, lattice, TARGET, 100, seed=0)
    assert chosen.sequence == design


def test_calls_of_equal_number_have_equal_draws_and_are_played_once(chain, seeds):
    one, other = (OpenLoop.at_one_speed(GOOD, speed) for speed in (0.2, 0.4))
    calls = Calls(chain, TARGET, budget=8, seed=0)
    before = calls.scores([one, other], 3)
    assert seeds[0::2] == seeds[1::2]
    assert len(set(seeds)) == 3
    assert not set(seeds) & set(evaluation_seeds(1000))
    np.testing.assert_array_equal(calls.scores([one], 5)[:, :3], before[:1])
    assert calls.count == 8
    with pytest.raises(SpentError):
        calls.scores([one], 6)


def test_what_a_policy_chose_does_the_same_when_it_is_frozen(chain: TubeFeedEnv) -> None:
    watched: Any = play(at_random, chain, TARGET, 3)
    assert play(choosing({TARGET: watched.choice}), chain, TARGET, 3).score == watched.score


def test_one_lucky_call_does_not_beat_many() -> None:
    choice = OpenLoop(GOOD, (0.2,) * 4)
    assert Tally(choice, (1.0,)).expected < Tally(choice, (1.0,) * 9).expected
    assert Tally(choice, (0.4,)).expected < Tally(choice, (1.0,)).expected


def test_a_choice_is_what_the_actions_can_express() -> None:
    env = TubeFeedEnv(components=4, fidelity="quasistatic", speeds=3, catalogue=["NSNS", "NNSS"])
    choice = OpenLoop(("NSNS", "NSNN", "NNSS", "NSNS"), (0.2, 0.01, 5.0, 0.08))
    played = choice.as_played(env)
    assert set(played.sequence) <= {"NSNS", "NNSS"}
    assert set(played.speeds) <= set(env.actions.speeds.tolist())
    assert played.as_played(env) == played
    assert play(choosing({TARGET: choice}), env, TARGET, 0).choice == played


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_frozen_speeds_belong_to_their_components(direction: str, chain: TubeFeedEnv) -> None:
    env = TubeFeedEnv(
        chain.scene.replace(feed={"direction": direction}), baseline=None, randomisation="none"
    )
    speeds = tuple(np.random.default_rng(0).choice(env.actions.speeds, 4).tolist())
    choice = OpenLoop(("NSSN", "NNSN", "SNSS", "SNNS"), speeds)
    outcome: Any = play(choosing({TARGET: choice}), env, TARGET, 0)
    assert outcome.scene.sequence == choice.sequence
    np.testing.assert_allclose(outcome.scene.speeds, choice.speeds)


def test_a_chain_that_is_chosen_as_a_whole_has_one_speed() -> None:
    env = SequenceDesignEnv(components=4, baseline=None, randomisation="none")
    choice = OpenLoop(GOOD, (0.01, 0.6, 0.6, 0.6))
    outcome = play(choosing({TARGET: choice}), env, TARGET, 0)
    assert outcome.choice == OpenLoop.at_one_speed(GOOD, 0.01)


def test_a_target_without_a_choice_is_named(lattice: TubeFeedEnv) -> None:
    with pytest.raises(ValueError, match="target: 'LRL' has no choice; must be one of LLR"):
        play(choosing({"LLR": OpenLoop(GOOD, (0.2,) * 4)}), lattice, TARGET, 0)


SETTINGS = EnvSettings(targets=("LRLLL", "RLRRR"))
KEY = {"search": "cross-entropy", "budget": 10}


def chosen(speed: float) -> Chosen:
    return Chosen(("NSNS",) * 6, (speed,) * 6, calls=10, successes=3, releases=4)


def test_choices_are_read_as_they_were_written_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "choices.json"
    ChoiceFile(path, KEY).add("LRLLL", chosen(0.1))
    again = ChoiceFile(path, KEY)
    assert again.chosen == {"LRLLL": chosen(0.1)}
    again.add("RLRRR", chosen(0.2))
    own = {"LRLLL": chosen(0.1), "RLRRR": chosen(0.2)}
    assert read_choices(path) == {word: OpenLoop(*each[:2]) for word, each in own.items()}
    with pytest.raises(ValueError, match="another search, with budget 10; must be 20"):
        ChoiceFile(path, KEY | {"budget": 20})
    path.write_text(path.read_text(encoding="utf-8").replace("0.1", "0.3"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"choices\.json: is not a file of choices .* damaged"):
        ChoiceFile(path, KEY)


def test_a_search_that_was_stopped_goes_on_with_the_next_target(tmp_path, monkeypatch):
    path = tmp_path / "choices.json"
    whole = dict(choose("cross-entropy", SETTINGS, tmp_path / "whole.json", budget=3))
    next(choose("cross-entropy", SETTINGS, path, budget=3))
    searched: set[str] = set()
    own_play = Episodes.play

    def noted(episodes: Any, seeds: Any, numbers: Any, *given: Any) -> Any:
        searched.update(episodes.setup.words[number] for number in numbers)
        return own_play(episodes, seeds, numbers, *given)

    monkeypatch.setattr(Episodes, "play", noted)
    assert dict(choose("cross-entropy", SETTINGS, path, budget=3)) == whole
    assert searched == {"RLRRR"}
    with pytest.raises(ValueError, match="with seed 0; must be 1"):
        choose("cross-entropy", SETTINGS, path, budget=3, seed=1)
    with pytest.raises(ValueError, match=r"goal: 0\.0 is not allowed; must be above 0"):
        choose("cross-entropy", SETTINGS, path, budget=3, goal=0.0)
