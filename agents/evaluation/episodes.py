"""Playing evaluation episodes, on several processes if wanted."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar, cast
from zlib import crc32

import joblib
import numpy as np

import magfold_env as mf
from agents.evaluation import policies
from agents.settings import EnvSettings
from agents.training.envs import make_env as make_gym_env
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.tasks.goals import goal_of
from magfold_env.parallel import without_warning

Result = TypeVar("Result")


@dataclass(frozen=True)
class Outcome:
    """How one episode ended."""

    target: str
    """The word wanted."""
    word: str
    """The word reached."""
    status: str
    """How the fold ended."""
    seed: int
    """Seed of the episode's draws."""
    success: bool
    """Whether the fold is the target."""
    score: float
    """That of the fold at the end."""
    reward: float
    """The sum of the rewards: the return."""
    joints: tuple[float, ...] = ()
    """Joint angles at the end [rad]."""
    choice: policies.OpenLoop | None = None
    """The components and the speeds that were asked for; None where the simulation broke down
    before all were."""
    scene: mf.Scene | None = None
    """The episode to replay; None likewise."""
    built: bool | None = None
    """Whether the same choice, under the same draws, folds into the target when the chain is built
    beforehand, so that magnets act inside the tube too; None if that was not tried."""


def make_env(settings: EnvSettings) -> FoldEnv[Any]:
    """Return the environment for evaluation.

    Shaping is left out: it does not change a fold, and its rewards are not what is compared.
    """
    return cast("FoldEnv[Any]", make_gym_env(settings.unshaped()).unwrapped)


@cache
def own_env(settings: EnvSettings) -> FoldEnv[Any]:
    """Return this process's own environment for evaluation, made once."""
    return make_env(settings)


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


def check(policy: str, settings: EnvSettings, trust_pickle: bool = False) -> None:
    """Let a policy choose how it begins with each target, before anything else begins.

    Raises
    ------
    ValueError
        If there is no such policy, it has nothing for a target, or knows other observations or
        actions.
    """
    env, player = own_env(settings), own_policy(policy, trust_pickle)
    for target in env.targets:
        observation, _ = env.reset(seed=0, options={"target": target})
        player.begin()
        try:
            player.act(env, observation, np.random.default_rng(0))
        except ValueError as error:
            trained = isinstance(player, policies.TrainedPolicy)
            remedy = "; magfold score plays the policies of tracks" if trained else ""
            raise ValueError(f"{policies.as_given(policy)}: {error}{remedy}") from None


def play(
    policy: policies.Policy,
    env: FoldEnv[Any],
    target: str,
    seed: int,
    rng: np.random.Generator | None = None,
    built: bool = False,
) -> Outcome:
    """Play one episode, whose draws follow from `seed`.

    The policy's own draws are from `rng`; by default they follow from `seed` and `target`. If
    `built`, the same choice is folded once more, built beforehand.
    """
    key = (1, crc32(target.encode()))
    rng = rng or np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    observation, info = env.reset(seed=seed, options={"target": target})
    policy.begin()
    actions: list[Any] = []
    total, terminated = 0.0, False
    while not terminated:
        actions.append(policy.act(env, observation, rng))
        observation, reward, terminated, _, info = env.step(actions[-1])
        total += float(reward)
    scene = env.to_scene() if info["step"] == env.scene.n else None
    judged = built_beforehand(env, scene, target) if built else None
    in_order = actions if env.scene.feed.direction == "forward" else actions[::-1]
    return Outcome(
        target=target,
        word=info["word"],
        status=info["status"],
        seed=seed,
        success=info["is_success"],
        score=info["score"],
        reward=total,
        joints=tuple(env.state.joint_angles.tolist()),
        choice=None if scene is None else policies.OpenLoop.of_actions(env, in_order),
        scene=scene,
        built=None if judged is None else judged[0],
    )


def spread_over(
    processes: int, function: Callable[..., Result], jobs: Iterable[tuple[Any, ...]]
) -> Iterator[Result]:
    """Yield what a function returns for each of some arguments, in their order.

    So many processes share the work; they are kept for what comes next. This one does it for 1.
    """
    parallel: Any = joblib.Parallel(processes, return_as="generator")
    yield from without_warning(parallel(joblib.delayed(function)(*job) for job in jobs))


def play_all(
    policy: str,
    settings: EnvSettings,
    episodes: Sequence[tuple[str, int]],
    processes: int = 1,
    built: bool = False,
    trust_pickle: bool = False,
) -> Iterator[Outcome]:
    """Play `episodes`, pairs of target and seed, and return their outcomes in that order.

    `agents.evaluation.policies.make_policy` says what `policy` may be and `trust_pickle` allows,
    and `play` what `built` means.
    """
    jobs = ((policy, settings, target, seed, built, trust_pickle) for target, seed in episodes)
    return spread_over(processes, _play, jobs)


def _play(
    policy: str, settings: EnvSettings, target: str, seed: int, built: bool, trust_pickle: bool
) -> Outcome:
    """Play one episode with this process's own policy and environment."""
    return play(own_policy(policy, trust_pickle), own_env(settings), target, seed, built=built)


def built_beforehand(
    env: FoldEnv[Any], scene: mf.Scene | None, target: str
) -> tuple[bool, float] | None:
    """Return success and score of the chain of an episode when it is built beforehand.

    None without dynamics; without a `scene` the simulation broke down, which is worth nothing.
    """
    if env.task.fidelity != "dynamics":
        return None
    if scene is None:
        return False, 0.0
    fold = mf.simulate(scene.replace(feed={"loading": "preloaded"}))
    goal, end = goal_of(target, env.task.match), (fold.status, fold.joint_angles)
    return goal.is_reached(*end), goal.score(*end)


own_policy = cache(policies.make_policy)
"""Returns this process's own copy of the policy of some name, made once."""
