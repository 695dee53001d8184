"""Tests of ablations: they remove only what they name, and compare equal draws."""

import itertools
import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import ablate
from agents.ablate import SEEING
from agents.evaluation import episodes, policies
from agents.evaluation.episodes import FROZEN, NO_MOTION, RANDOM_SPEEDS, Method, Outcome
from agents.settings import EnvSettings
from agents.training.policy_files import SavedPolicy
from magfold_env.scoring.observation_view import blind
from magfold_env.scoring.policy_file import ObservationForm
from tests.agents.training import call

STRONG = EnvSettings(targets=("LRLLL", "RLRRR"), randomisation="strong")
QUASI = EnvSettings(components=4, fidelity="quasistatic", targets=("LRL", "RLR"))
RANDOM = Method("random", ("random",))
ROW = np.array([0])


def seen(env: Any, observation: Any) -> Any:
    """Return the entries of an observation that a camera would have to measure."""
    entries = observation["observation"] if isinstance(observation, dict) else observation
    return np.concatenate([entries[..., env.layout.slices[name]] for name in env.layout.measured])


class Reading:
    """A policy whose actions depend only on entries that a camera measures."""

    def __init__(self) -> None:
        env = episodes.make_env(STRONG)
        self.observation_space, self.action_space = env.observation_space, env.action_space
        self._layout = env.layout

    def predict(self, observation: Any, state: Any, episode_start: Any, deterministic: bool) -> Any:
        parts = [observation[:, self._layout.slices[name]] for name in self._layout.measured]
        numbers = (1e4 * np.abs(np.hstack(parts).sum(axis=1))).astype(int)
        return np.stack([numbers % 16, numbers % 9], axis=1), None


@pytest.fixture
def reading(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a file name stand for the policy `Reading`."""
    saved: Any = SavedPolicy(Reading(), ObservationForm(), steps=0)  # pyright: ignore[reportArgumentType]

    def own_policy(name: str) -> policies.Policy:
        return policies.trained(saved, name.startswith(policies.NO_MOTION))

    monkeypatch.setattr(episodes, "own_policy", own_policy)


@pytest.mark.parametrize("kind", ["MagFold/TubeFeed-v0", "MagFold/TubeFeedGoal-v0"])
def test_two_motions_of_one_task_look_alike_without_motion(kind: Any) -> None:
    settings = STRONG.model_copy(update={"id": kind})
    envs = [episodes.make_env(settings) for _ in range(2)]
    for trial in range(3):
        for k, env in enumerate(envs):
            env.reset(seed=2 * trial + k, options={"target": "LRLLL"})
        envs[0].action_space.seed(trial)
        for _ in range(envs[0].scene.n):
            action = envs[0].action_space.sample()
            first, second = (env.step(action)[0] for env in envs)
            assert not np.array_equal(seen(envs[0], first), seen(envs[1], second))
            before = deepcopy(first)
            one = blind(envs[0].layout, first)
            np.testing.assert_equal(one, blind(envs[1].layout, second))
            np.testing.assert_equal(first, before)
            assert not seen(envs[0], one).any()
            known(envs[0], one, first)


def known(env: Any, one: Any, whole: Any) -> None:
    """Check that an observation without motion has all other entries."""
    if isinstance(one, dict):
        assert not one["achieved_goal"].any()
        np.testing.assert_array_equal(one["desired_goal"], whole["desired_goal"])
        one, whole = one["observation"], whole["observation"]
    for name in env.layout.slices.keys() - set(env.layout.measured):
        part = env.layout.slices[name]
        np.testing.assert_array_equal(one[part], whole[part])
        assert one[part].any()


@pytest.mark.usefixtures("reading")
def test_what_is_frozen_repeats_one_episode_and_no_motion_decides_nothing() -> None:
    env = episodes.make_env(STRONG)

    def choices(change: episodes.Change) -> set[Any]:
        policy = episodes.changed("reading", change, STRONG)
        return {episodes.play(policy, env, "LRLLL", seed).choice for seed in range(4)}

    assert len(choices(None)) == 4
    still = episodes.make_env(STRONG.model_copy(update={"randomisation": "none"}))
    policy = episodes.changed("reading", None, STRONG)
    assert choices(FROZEN) == {episodes.play(policy, still, "LRLLL", seed=9).choice}
    (unseeing,) = choices(NO_MOTION)
    assert set(unseeing.sequence) == {"NNNN"}


@pytest.mark.parametrize("kind", ["multidiscrete", "discrete", "box"])
def test_other_speeds_change_speeds_only(kind: Any) -> None:
    env = episodes.make_env(QUASI.model_copy(update={"actions": kind}))
    env.reset(seed=0)
    drawn: set[float] = set()

    def chosen(policy: policies.Policy, seed: int) -> tuple[Any, float]:
        act = policy(env, [0], [np.random.default_rng(seed)])
        return env.actions.decode(act(env.episodes, ROW)[0])

    for seed in range(60):
        faces, _ = chosen(policies.at_random, seed)
        for speed in env.actions.speeds:
            other = chosen(policies.at_speed(policies.at_random, speed), seed)
            assert other == (faces, pytest.approx(speed, rel=1e-6))
        same, speed = chosen(policies.at_speed(policies.at_random, None), seed)
        assert same == faces
        drawn.add(round(speed, 6))
    assert drawn == set(env.actions.speeds.round(6))


def test_differences_are_those_of_the_same_episodes() -> None:
    ends = {SEEING: (True, True, False), NO_MOTION: (True, False, False)}
    results = {
        name: [[Outcome("LR", "LR", "folded", k, end, 0.5 + 0.5 * end, 0.0) for k, end in row]]
        for name, row in ((name, list(enumerate(each))) for name, each in ends.items())
    }
    row = ablate.summarise(results)[NO_MOTION]
    assert row.figures["difference"][0] == pytest.approx(-1 / 3)
    assert row.score == pytest.approx((1.0 + 0.5 + 0.5) / 3)


@pytest.mark.medium
def test_a_run_that_was_broken_off_goes_on(tmp_path, monkeypatch):
    whole = ablate.measure(RANDOM, QUASI, 5, 1, tmp_path / "whole")
    played, own_play = itertools.count(), episodes.play

    def play(*given: Any, **options: Any) -> Outcome:
        if next(played) == 7:
            raise KeyboardInterrupt
        return own_play(*given, **options)

    monkeypatch.setattr(episodes, "play", play)
    with pytest.raises(KeyboardInterrupt):
        ablate.measure(RANDOM, QUASI, 5, 1, tmp_path / "broken")
    assert ablate.measure(RANDOM, QUASI, 5, 1, tmp_path / "broken") == whole
    assert next(played) == len(whole) * 10 + 1


def test_the_command_prints_its_table_again_and_refuses_other_episodes(tmp_path: Path) -> None:
    given: list[object] = ["random", "--processes", 1, "--output", tmp_path, "--draws"]
    for key in ("components=4", "fidelity=quasistatic", "targets=[LRL, RLR]"):
        given = ["--env", key, *given]
    first, again, other = (call("ablate", *given, draws) for draws in "223")
    assert first.exit_code == again.exit_code == 0, first.output
    table = first.stdout[first.stdout.index("random, ") :]
    assert again.stdout[again.stdout.index("random, ") :] == table
    content = json.loads((tmp_path / "ablation.json").read_text(encoding="utf-8"))
    names = [SEEING, NO_MOTION, FROZEN, "0.010 m/s", "0.600 m/s", RANDOM_SPEEDS]
    assert set(names) < set(content["rows"])
    assert all(name in table for name in content["rows"])
    assert other.exit_code == 2
    assert "was written by another run, whose seeds" in other.output
