"""What is taken away is gone, the rest stays, and what it was worth is told from draws alike."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from agents.ablate import __main__ as command
from agents.ablate.ablations import BLIND, FROZEN, RANDOM_SPEEDS, SEEING, SpeedPolicy, ablated
from agents.ablate.ablations import play as play_ablated
from agents.evaluation import episodes, policies
from agents.evaluation.report import Method
from agents.settings import EnvSettings
from magfold_env.scoring.shown import blind
from tests.agents.test_intervals import WORDS
from tests.killed import run_until_killed

STRONG = EnvSettings(targets=("LRLLL", "RLRRR"), randomisation="strong")
QUASI = EnvSettings(components=4, fidelity="quasistatic", targets=("LRL", "RLR"))
RANDOM = Method("random", ("random",))


def seen(env: Any, observation: Any) -> Any:
    """Return the entries of an observation that a camera would have to measure."""
    entries = observation["observation"] if isinstance(observation, dict) else observation
    return np.concatenate([entries[env.layout.slices[name]] for name in env.layout.measured])


class Reading(policies.Policy):
    """Lets what it sees of the chain decide, and nothing else."""

    def act(self, env: Any, observation: Any, rng: object) -> Any:
        number = int(1e4 * abs(float(seen(env, observation).sum())))
        return np.array([number % 16, number % 9])


class Looking(policies.DesignPolicy):
    """Plays the minimiser's design while it sees a chain."""

    def act(self, env: Any, observation: Any, rng: Any) -> Any:
        action = super().act(env, observation, rng)
        return action if seen(env, observation).any() else np.zeros_like(action)


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let names stand for the policies of this test."""
    known = {"reading": Reading(), "looking": Looking(), "design": policies.DesignPolicy()}

    def own_policy(name: str) -> policies.Policy:
        policy = known[name.removeprefix(policies.BLIND)]
        return policies.BlindPolicy(policy) if name.startswith(policies.BLIND) else policy

    monkeypatch.setattr(episodes, "own_policy", own_policy)


@pytest.mark.parametrize("kind", ["MagFold/TubeFeed-v0", "MagFold/TubeFeedGoal-v0"])
@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_two_motions_of_one_task_look_alike_to_the_blind(kind: Any, direction: str) -> None:
    settings = STRONG.model_copy(update={"id": kind})
    envs = [episodes.make_env(settings) for _ in range(2)]
    if direction == "backward":
        scene = envs[0].scene.replace(feed={"direction": direction})
        # Computing baselines for it would take long.
        options: dict[str, Any] = {"randomisation": "strong"}
        options |= {} if "Goal" in kind else {"baseline": None}
        envs = [type(env)(scene, **options) for env in envs]
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
    """Check that an observation without motion has everything else."""
    if isinstance(one, dict):
        assert not one["achieved_goal"].any()
        np.testing.assert_array_equal(one["desired_goal"], whole["desired_goal"])
        one, whole = one["observation"], whole["observation"]
    for name in env.layout.slices.keys() - set(env.layout.measured):
        part = env.layout.slices[name]
        np.testing.assert_array_equal(one[part], whole[part])
        assert one[part].any()


@pytest.mark.usefixtures("made_up")
def test_the_frozen_replay_one_episode_whatever_the_draw() -> None:
    env = episodes.make_env(STRONG)

    def choices(policy: policies.Policy) -> set[Any]:
        return {episodes.play(policy, env, "LRLLL", seed).choice for seed in range(4)}

    assert len(choices(Reading())) == 4
    frozen = choices(ablated(FROZEN, "reading", STRONG, "LRLLL"))
    still = episodes.make_env(STRONG.model_copy(update={"randomisation": "none"}))
    assert frozen == {episodes.play(Reading(), still, "LRLLL", seed=9).choice}


@pytest.mark.parametrize("kind", ["multidiscrete", "discrete", "box"])
def test_other_speeds_change_speeds_only(kind: Any) -> None:
    env = episodes.make_env(QUASI.model_copy(update={"actions": kind}))
    observation, _ = env.reset(seed=0)
    rng, seeds = np.random.default_rng(0), np.random.default_rng(1)
    drawn: list[float] = []
    for _ in range(60):
        seed = int(seeds.integers(2**31))
        faces, _ = env.actions.decode(
            policies.RandomPolicy().act(env, observation, np.random.default_rng(seed))
        )

        def replaced(speed: float | None, rng: Any, seed: int = seed) -> tuple[Any, float]:
            class Given(policies.RandomPolicy):
                def act(self, env: Any, observation: Any, rng: object) -> Any:
                    return super().act(env, observation, np.random.default_rng(seed))

            return env.actions.decode(SpeedPolicy(Given(), speed).act(env, observation, rng))

        for speed in env.actions.speeds:
            assert replaced(speed, None) == (faces, pytest.approx(speed, rel=1e-6))
        same, speed = replaced(None, rng)
        assert same == faces
        drawn.append(round(speed, 6))
    assert set(drawn) == set(env.actions.speeds.round(6))


@pytest.mark.medium
@pytest.mark.usefixtures("made_up")
def test_only_who_reads_motion_loses_when_blind(tmp_path: Path) -> None:
    worth: dict[str, dict[Any, float]] = {}
    for name in ("looking", "design"):
        rows = command.measure(Method(name, (name,)), STRONG, 2, 1, tmp_path / name)
        assert [row.ablation for row in rows[:3]] == [SEEING, BLIND, FROZEN]
        worth[name] = {row.ablation: float(row.difference.value) for row in rows}
    assert worth["looking"][BLIND] <= -0.75
    assert worth["looking"][FROZEN] >= -0.25
    assert worth["design"][BLIND] == 0.0


@pytest.mark.medium
def test_differences_are_paired_as_a_slow_bootstrap_pairs_them() -> None:
    rng = np.random.default_rng(0)
    policies_, words, draws = 4, tuple(WORDS[:13]), 6
    seeing = rng.random((policies_, len(words), 1)) * rng.random((1, len(words), 1))
    chances = np.stack([seeing, seeing - 0.1 * rng.random(seeing.shape)])
    ends = np.zeros((2, policies_, len(words), draws, 2))
    # The draws are the same for both.
    ends[..., 0] = rng.random((policies_, len(words), draws)) < chances
    ends[..., 1] = 0.5 + 0.5 * ends[..., 0]
    row = command.summarise([SEEING, BLIND], ends, words)[1]
    resamples: list[float] = []
    for _ in range(4000):
        runs = rng.choice(policies_, policies_)
        places = rng.choice(len(words), len(words))
        total = 0.0
        for run in runs:
            for place in places:
                for draw in range(draws):
                    total += ends[1, run, place, draw, 0] - ends[0, run, place, draw, 0]
        resamples.append(total / (policies_ * len(words) * draws))
    low, high = np.percentile(resamples, [2.5, 97.5])
    np.testing.assert_allclose((row.difference.low, row.difference.high), (low, high), atol=0.01)
    assert row.difference.value == pytest.approx((ends[1] - ends[0])[..., 0].mean())
    assert row.score == pytest.approx(ends[1, ..., 1].mean())
    assert row.difference.high - row.difference.low < row.success.high - row.success.low


KILLED = """
import sys
from pathlib import Path
from agents.ablate.__main__ import measure
from agents.evaluation.report import Method
from agents.settings import EnvSettings

settings = EnvSettings.model_validate_json(sys.argv[1])
measure(Method("random", ("random",)), settings, 1, 1, Path(sys.argv[2]))
"""


@pytest.mark.medium
def test_a_run_that_was_killed_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = command.measure(RANDOM, QUASI, 1, 1, tmp_path / "whole")
    run_until_killed(10, KILLED, QUASI.model_dump_json(), str(tmp_path / "killed"))
    played: list[Any] = []

    def play(*job: Any) -> tuple[bool, float]:
        played.append(job)
        return play_ablated(*job)

    monkeypatch.setattr(command, "play", play)
    assert command.measure(RANDOM, QUASI, 1, 1, tmp_path / "killed") == whole
    assert len(played) == len(whole) * 2 - 10


def test_the_command_prints_its_table_again_and_refuses_other_episodes(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(command.main)
    given = ["random", "--processes", "1", "--output", str(tmp_path), "--draws"]
    for key in ("components=4", "fidelity=quasistatic", "targets=[LRL, RLR]"):
        given = ["--env", key, *given]
    first, again, other = (CliRunner().invoke(app, [*given, draws]) for draws in "223")
    assert first.exit_code == again.exit_code == 0, first.output
    table = first.stdout[first.stdout.index("random, ") :]
    assert again.stdout[again.stdout.index("random, ") :] == table
    content = json.loads((tmp_path / "ablation.json").read_text(encoding="utf-8"))
    names = [SEEING, BLIND, FROZEN, "0.010 m/s", "0.600 m/s", RANDOM_SPEEDS]
    assert set(names) < set(content["rows"])
    assert all(name in table for name in content["rows"])
    assert other.exit_code == 2
    assert "was written by another run, whose seeds" in other.output


def test_there_must_be_something_to_see(tmp_path: Path) -> None:
    settings = EnvSettings(id="MagFold/SequenceDesign-v0")
    with pytest.raises(ValueError, match=r"env\.id: 'MagFold/SequenceDesign-v0' is not allowed"):
        command.measure(RANDOM, settings, 1, 1, tmp_path)
