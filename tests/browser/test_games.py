"""Tests that a page's episodes and networks equal the package's environments and policies."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils import seeding

import magfold_env  # noqa: F401 - registers the environments
from magfold_env.browser import games
from magfold_env.scoring.player import Player
from tests.browser import built
from tests.browser.test_engine import bits

EPISODES = {"tube_feed": 26, "unknown_floor": 6}  # of a policy
IDS = {"tube_feed": "MagFold/TubeFeed-v0", "unknown_floor": "MagFold/UnknownFloor-v0"}


def make(game: str) -> Any:
    options: Any = {} if game == "tube_feed" else {"actions": "discrete"}
    return gymnasium.make(IDS[game], **options).unwrapped


def drawn(env: Any, seed: int, draws: int) -> dict[str, list[float]]:
    """Return the draws of an episode with this seed, in their order."""
    rng = seeding.np_random(seed)[0]
    rng.integers(len(env.setup.words))
    numbers = rng.random(draws).tolist()
    noise = np.random.default_rng(rng.integers(2**63))
    return {
        "numbers": numbers,
        "normals": noise.standard_normal(251 * (3 * env.scene.n + 1)).tolist(),
    }


def play(env: Any, game: str, seed: int, goal: int, choose: Any) -> dict[str, Any]:
    """Play an episode and return all results."""
    chosen = env.targets[goal] if game == "tube_feed" else goal
    options = {"target" if game == "tube_feed" else "task": chosen}
    observation, _ = env.reset(seed=seed, options=options)
    found: dict[str, Any] = {"observations": [observation], "actions": [], "rewards": []}
    done, info = False, {}
    while not done:
        action = choose(observation)
        found["actions"].append(np.ravel(action).tolist())
        observation, reward, done, _, info = env.step(action)
        found["observations"].append(observation)
        found["rewards"].append(reward)
    return found | {"info": info, "headings": bits(env.state.angles)}


@pytest.mark.medium
@pytest.mark.parametrize("game", IDS)
def test_an_episode_is_that_of_the_environment(game: str) -> None:
    env = make(game)
    env.action_space.seed(4)
    draws = {"tube_feed": 2 * 6 + 4 + 5 * 6, "unknown_floor": 2 * 6 + 4 + 5 * 6}[game]
    goals = range(0, len(env.setup.words), 6)
    here = [
        play(env, game, seed, goal, lambda _: env.action_space.sample())
        for seed, goal in enumerate(goals)
    ]
    episodes = [
        {"goal": goal, "actions": each["actions"], **drawn(env, seed, draws)}
        for (seed, goal), each in zip(enumerate(goals), here, strict=True)
    ]
    found = built.run({"task": "episodes", "game": game, "episodes": episodes})
    for mine, there in zip(here, found, strict=True):
        assert there["draws"] == draws
        assert there["done"]
        assert there["headings"] == mine["headings"]
        assert np.allclose(there["observations"], mine["observations"], rtol=0.0, atol=2e-7)
        assert np.allclose(there["rewards"], mine["rewards"], rtol=0.0, atol=1e-12)
        info = mine["info"]
        assert (there["status"], there["success"]) == (info["status"], info["is_success"])
        assert there["score"] == pytest.approx(info["score"], abs=1e-12)


@pytest.mark.medium
@pytest.mark.parametrize("game", IDS)
def test_a_network_acts_as_the_policy_that_was_shipped(game: str) -> None:
    from agents.evaluation.shipped import load_shipped  # noqa: PLC0415 - needs torch

    name, _, number = games.POLICIES[game].rpartition("-")
    saved, env = load_shipped(name, int(number)), make(game)
    episodes: list[Any] = []
    for seed in range(EPISODES[game]):
        player = Player(saved.policy, saved.shown, env)
        goal = seed % len(env.setup.words)

        def act(seen: Any, player: Player = player) -> Any:
            return player.act(seen[None])[0]

        episodes.append(play(env, game, seed, goal, act))
    seen = [[each.tolist() for each in episode["observations"][:-1]] for episode in episodes]
    found = built.run({"task": "actions", "game": game, "episodes": seen})
    assert found == [episode["actions"] for episode in episodes]


def test_weights_are_rounded_to_24_bits() -> None:
    numbers = np.random.default_rng(0).standard_normal(10_000).astype(np.float32)
    planes = np.frombuffer(games.shortened(numbers), dtype=np.uint8).reshape(3, -1)
    bits = np.zeros(numbers.size, dtype="<u4")
    for plane, shift in zip(planes, (24, 16, 8), strict=True):
        bits |= plane.astype("<u4") << np.uint32(shift)
    assert np.allclose(bits.view("<f4"), numbers, rtol=2.0**-16, atol=0.0)
