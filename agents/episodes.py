"""Playing evaluation episodes, on several processes if wanted."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from typing import cast

import numpy as np

from agents.policies import Policy, make_policy
from agents.settings import EnvSettings
from agents.training_envs import make_env as make_gym_env
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.scene import Scene


@dataclass(frozen=True)
class Outcome:
    """How one episode ended.

    Attributes
    ----------
    target, word, status : str
        The word wanted, the word reached, and how the fold ended.
    seed : int
        Seed of the episode's draws.
    success : bool
        Whether the fold is the target.
    score, reward : float
        The score, and what it is above the baseline.
    scene : Scene or None
        The episode to replay; None where the simulation broke down before its end.
    """

    target: str
    word: str
    status: str
    seed: int
    success: bool
    score: float
    reward: float
    scene: Scene | None


def make_env(settings: EnvSettings) -> TubeFeedEnv:
    """Return the environment for evaluation.

    Shaping is left out: it does not change a fold, and its rewards are not what is compared.
    """
    return cast("TubeFeedEnv", make_gym_env(settings.unshaped()).unwrapped)


def warm_up(settings: EnvSettings) -> None:
    """Play an episode at random, so that the engine is compiled before anything else begins.

    The first use after an installation takes up to a minute, which is neither to count as training
    time nor to be spent in every process.
    """
    env = make_env(settings)
    env.reset(seed=0)
    env.action_space.seed(0)
    ended = False
    while not ended:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated


def play(policy: Policy, env: TubeFeedEnv, target: str, seed: int) -> Outcome:
    """Play one episode for `target` with the draws of `seed`."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1,)))
    observation, info = env.reset(seed=seed, options={"target": target})
    terminated = False
    while not terminated:
        observation, _, terminated, _, info = env.step(policy.act(env, observation, rng))
    complete = info["step"] == env.scene.n
    return Outcome(
        target=target,
        word=info["word"],
        status=info["status"],
        seed=seed,
        success=info["is_success"],
        score=info["score"],
        reward=info["score"] - info["baseline"],
        scene=env.to_scene() if complete else None,
    )


def play_all(
    policy: str,
    settings: EnvSettings,
    episodes: Sequence[tuple[str, int]],
    processes: int = 1,
) -> Iterator[Outcome]:
    """Play `episodes`, pairs of target and seed, and yield their outcomes in that order.

    Parameters
    ----------
    policy : str
        What `agents.policies.make_policy` understands.
    settings : EnvSettings
        The environment.
    episodes : sequence of (str, int)
        Targets and seeds.
    processes : int
        How many episodes to play at a time; 1 plays them in this process.
    """
    jobs = [(policy, settings, target, seed) for target, seed in episodes]
    if processes == 1:
        yield from map(_play, *zip(*jobs, strict=True))
        return
    # Forking a process whose compiled kernels run threads is not safe.
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        yield from pool.map(_play, *zip(*jobs, strict=True), chunksize=4)


def _play(policy: str, settings: EnvSettings, target: str, seed: int) -> Outcome:
    """Play one episode with this process's own policy and environment."""
    return play(_own_policy(policy), _own_env(settings), target, seed)


_own_policy = cache(make_policy)
_own_env = cache(make_env)
