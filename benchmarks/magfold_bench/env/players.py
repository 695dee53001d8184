"""Environments, alone and side by side, random play on them, and how fast it is."""

from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

from magfold_env.envs import register_envs
from magfold_env.reporting import timing
from magfold_env.reporting.tables import Row, verdict

TUBE_FEED = "MagFold/TubeFeed-v0"
ENVS = 64
"""Environments in a vector unless a part says otherwise."""
QUARTILES = ("lower quartile", "upper quartile")

Single = gymnasium.Env[Any, Any]
Vector = VectorEnv[Any, Any, Any]


def single(env_id: str, **options: Any) -> Single:
    """Return one environment as a user gets it, Gymnasium's default wrappers included."""
    register_envs()
    return gymnasium.make(env_id, **options)


def vector(env_id: str, count: int, threads: int = 1, **options: Any) -> Vector:
    """Return ``count`` environments side by side, which begin anew within the step that ends them.

    Where an id has a vector form of its own it is taken, on so many threads; else single
    environments take their steps one after another.
    """
    register_envs()
    kind: dict[str, Any] = {"autoreset_mode": AutoresetMode.SAME_STEP}
    if gymnasium.spec(env_id).vector_entry_point is not None:
        kind["threads"] = threads
    else:
        kind = {"vector_kwargs": kind}
    return gymnasium.make_vec(env_id, num_envs=count, **kind, **options)


def drawn_actions(env: Single | Vector, steps: int, seed: int) -> list[Any]:
    """Return as many random actions; for a vector each is one for all its environments."""
    space: Any = env.action_space  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    space.seed(seed)
    return [space.sample() for _ in range(steps)]


def stepping(env_id: str, envs: int | None, steps: int, seed: int, **options: Any) -> timing.Task:
    """Return the task to take steps with random actions; a sample goes on where the last ended.

    Parameters
    ----------
    envs
        How many environments are side by side; None for a single one.
    steps
        In all of them together: a multiple of their number.
    """
    if envs is None:
        alone = single(env_id, **options)
        alone.reset(seed=seed)
        chosen = drawn_actions(alone, steps, seed)
        return timing.unprepared(lambda: step_single(alone, chosen))
    together = vector(env_id, envs, **options)
    together.reset(seed=seed)
    many = drawn_actions(together, steps // envs, seed)
    return timing.unprepared(lambda: step_vector(together, many))


def step_single(env: Single, actions: Iterable[Any]) -> None:
    """Take steps, beginning anew where an episode ends."""
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()


def step_vector(env: Vector, actions: Iterable[Any]) -> None:
    """Take steps."""
    for action in actions:
        env.step(action)


def episode_length(env: Single, least: int) -> float:
    """Return the mean number of steps of an episode with random actions, over ``least`` steps."""
    lengths: list[int] = []
    while sum(lengths) < least:
        env.reset()
        steps, over = 0, False
        while not over:
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            over = terminated or truncated
            steps += 1
        lengths.append(steps)
    return sum(lengths) / len(lengths)


def play_single(env: Single, seed: int, actions: NDArray[Any]) -> None:
    """Play episodes one after another that `play_vector` plays side by side.

    Parameters
    ----------
    seed
        Of the first episode; those of the others follow it.
    actions
        Shape (steps, episodes, …).
    """
    for k in range(actions.shape[1]):
        env.reset(seed=seed + k)
        for action in actions[:, k]:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                break


def play_vector(env: Vector, seed: int, actions: NDArray[Any]) -> None:
    """Play an episode on every environment; arguments are those of `play_single`."""
    env.reset(seed=seed)
    step_vector(env, actions)


def log_uniform(rng: np.random.Generator, steps: int, episodes: int) -> NDArray[np.float32]:
    """Return random ``box`` actions for tube-feed episodes, shape (steps, episodes, 5).

    Every magnet is N or S with equal chance, and speeds are log-uniform over their whole range.
    """
    return rng.uniform(-1.0, 1.0, (steps, episodes, 5)).astype(np.float32)


def rate_cells(what: str, taken: timing.Timing, count: float) -> Row:
    """Return the cells of a table's row that tell how often a second ``what`` is done.

    Parameters
    ----------
    taken
        Time of ``count`` of them.
    """
    spread = taken.spread
    return {
        f"{what}/s": count / spread.median,
        "lower quartile": count / spread.high,
        "upper quartile": count / spread.low,
    }


def rate_verdict(rate: float, wanted: float) -> str:
    """Say whether a rate [1/s] is as high as wanted."""
    return f"at least {wanted:,.0f} are asked for: {verdict(rate >= wanted)}"
