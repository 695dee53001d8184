"""Tests of imitation: learners copy the baseline's actions and expect its score."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from sb3_contrib.common.recurrent.type_aliases import RNNStates

from agents.settings import TrainSettings
from agents.training import models
from agents.training.envs import make_env, make_training_envs
from agents.training.imitation import Demonstrations, Steps, evaluated, imitate
from agents.training.run import train
from magfold_env.scoring.observation_view import blind
from tests.agents.training import same_weights, tiny

FLOOR = "MagFold/UnknownFloor-v0"


def settings(own: Any = None, **given: Any) -> TrainSettings:
    """Return the settings of a short run with imitation."""
    env = {"id": FLOOR, "actions": "discrete"}
    return tiny(own={"gamma": 0.99, "learning_rate": 0.003, **(own or {})}, env=env, imitate=given)


def test_episodes_are_those_of_the_environment_played_as_baselines_do(tmp_path: Path) -> None:
    given, seeds = settings(episodes=3, random=0.0), [5, 6, 7]
    steps = Demonstrations(given, tmp_path).block(seeds)
    env: Any = make_env(given.env, given.learner.gamma).unwrapped
    parts: list[tuple[int, int, Any, float]] = []
    for number, seed in enumerate(seeds):
        seen, _ = env.reset(seed=seed, options={"task": number})
        action, over, took = env.actions.encode(env.baseline_of(number).speed), False, []
        while not over:
            before = seen
            seen, reward, over, _, _ = env.step(action)
            took.append((before, reward))
        earned = 0.0
        for at, (before, reward) in reversed(list(enumerate(took))):
            earned = reward + 0.99 * earned
            parts.append((at, number, (before, action), earned))
    # Those of a block are of one time after another.
    parts.sort(key=lambda part: part[:2])
    np.testing.assert_array_equal(steps.seen, np.array([each[2][0] for each in parts]))
    np.testing.assert_array_equal(steps.actions, np.array([each[2][1] for each in parts]))
    np.testing.assert_allclose(steps.returns, [each[3] for each in parts], rtol=1e-12)


def test_what_chance_replaces_is_done_and_not_imitated(tmp_path: Path) -> None:
    plain, mixed = (
        Demonstrations(settings(episodes=4, random=x), tmp_path).block(range(4)) for x in (0.0, 0.5)
    )
    for steps in (plain, mixed):
        assert len(np.unique(steps.actions)) <= 4
    assert not np.array_equal(mixed.seen, plain.seen)


def test_the_blind_are_shown_no_motion(tmp_path: Path) -> None:
    given = settings({"blind": True}, episodes=2)
    layout = make_env(given.env).unwrapped.layout  # pyright: ignore[reportAttributeAccessIssue]
    seen = Demonstrations(given, tmp_path).block([0, 1]).seen
    np.testing.assert_array_equal(seen, blind(layout, seen))


@pytest.mark.parametrize("by_episode", [False, True])
def test_batches_hold_every_step_once_and_whole_episodes_in_rows(by_episode: bool) -> None:
    lengths = [3, 1, 4, 1, 5, 9, 2, 6]
    # Of one time after another, as they are played.
    of = [e for at in range(max(lengths)) for e, length in enumerate(lengths) if at < length]
    zeros = np.zeros(len(of))
    steps = Steps(zeros, zeros, zeros, np.array(of))
    batches = list(steps.batches(8, np.random.default_rng(0), by_episode))
    places = np.concatenate([each.ravel() for each in batches])
    assert sorted(places[places >= 0]) == list(range(len(of)))
    assert len(batches) > 2
    if by_episode:
        rows = [row[row >= 0] for each in batches for row in each]
        assert [len(set(steps.episodes[row])) for row in rows] == [1] * len(lengths)
        assert all(np.all(np.diff(row) > 0) for row in rows)
        assert all(np.all(np.diff(each < 0, axis=1) >= 0) for each in batches)


@pytest.mark.medium
def test_what_is_learned_from_whole_episodes_is_what_is_told_step_by_step(tmp_path: Path) -> None:
    given = settings({"algorithm": "recurrent-ppo", "lstm": {"hidden": 8}}, episodes=6)
    model: Any = models.make_model(given.learner, make_training_envs(given, 0), 0)
    steps = Demonstrations(given, tmp_path).block(range(6))
    (batch,) = steps.batches(10**6, np.random.default_rng(0), True)
    found = [each.detach().numpy() for each in evaluated(model.policy, steps, batch)]
    at, policy = 0, model.policy
    for row in batch:
        nothing = 2 * (torch.zeros(1, 1, 8),)
        memory, starts = RNNStates(nothing, nothing), torch.ones(1)
        for place in row[row >= 0]:
            seen, action = (
                torch.as_tensor(steps.seen[[place]]),
                torch.tensor(steps.actions[[place]]),
            )
            value, likely, _ = policy.evaluate_actions(seen, action, memory, starts)
            _, _, _, memory = policy.forward(seen, memory, starts)
            starts = torch.zeros(1)
            told = value.item(), likely.item(), steps.returns[place]
            np.testing.assert_allclose([each[at] for each in found], told, rtol=1e-4, atol=1e-5)
            at += 1
    assert at == len(found[0]) == len(steps.returns)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("learner", "least"),
    [({"algorithm": "ppo"}, 0.35), ({"algorithm": "recurrent-ppo", "lstm": {"hidden": 32}}, 0.25)],
)
def test_networks_come_to_choose_and_to_expect_the_same(learner, least, tmp_path):
    own = learner | {"hidden": [64], "n_steps": 32, "batch_size": 64}
    run = settings(own, episodes=80, epochs=10, random=0.0, batch_size=64, learning_rate=0.003)
    model: Any = models.make_model(run.learner, make_training_envs(run, 0), 0)
    steps = Demonstrations(run, tmp_path).block(range(40))

    def told() -> tuple[float, float]:
        batches = steps.batches(64, np.random.default_rng(0), "lstm" in learner)
        parts = zip(*(evaluated(model.policy, steps, each) for each in batches), strict=True)
        values, likely, returns = (torch.cat(each).detach().numpy() for each in parts)
        return np.mean(likely > np.log(0.5)), np.corrcoef(values, returns)[0, 1]

    before = told()
    imitate(model, run, tmp_path)
    likely, expected = told()
    assert likely > 0.8 > before[0]
    assert expected > least > before[1]


@pytest.mark.medium
def test_a_run_that_imitates_repeats_itself(tmp_path: Path) -> None:
    runs = [train(settings(episodes=4), tmp_path / name) for name in ("a", "b")]
    assert same_weights(*runs)
    other = train(settings(episodes=8), tmp_path / "c")
    assert not same_weights(runs[0], other)
