"""Vector environments beside Gymnasium's own ones, and a comparison of the two."""

from typing import Any, get_args

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from magfold_env.envs.spaces.actions import ActionKind, TrayKind
from magfold_env.scoring.track import TRAYS


def kinds_of(env_id: str) -> tuple[str, ...]:
    """Return the possible kinds of actions."""
    return get_args(TrayKind if env_id in TRAYS else ActionKind)


def pair(env_id: str, count: int, mode: AutoresetMode, **options: Any) -> tuple[Any, SyncVectorEnv]:
    """Return a native vector environment and Gymnasium's around single ones."""
    threads = options.pop("threads", 2)
    native: Any = gymnasium.make_vec(
        env_id, num_envs=count, autoreset_mode=mode, threads=threads, **options
    )
    single: Any = gymnasium.make_vec(
        env_id, num_envs=count, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode},
        **options,
    )  # fmt: skip
    return native, single


def same(one: Any, other: Any) -> bool:
    """Return whether two results of vector environments are identical, including their types."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    one, other = np.asarray(one), np.asarray(other)
    if one.dtype == other.dtype == object and one.ndim:
        return len(one) == len(other) and all(map(same, one, other))
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def play(env: VectorEnv, steps: int, seed: int = 5) -> list[Any]:
    """Return all results for random actions; DISABLED environments are reset explicitly."""
    env.action_space.seed(seed)
    said: list[Any] = [env.reset(seed=seed)]
    for _ in range(steps):
        said.append(env.step(env.action_space.sample()))
        over = said[-1][2] | said[-1][3]
        if env.metadata["autoreset_mode"] == AutoresetMode.DISABLED and over.any():
            said.append(env.reset(options={"reset_mask": over}))
    return said


def alike(env_id: str, count: int, mode: AutoresetMode, steps: int, **options: Any) -> bool:
    """Return whether the native environment and Gymnasium's give the same results."""
    native, single = pair(env_id, count, mode, **options)
    assert native.observation_space == single.observation_space
    assert native.action_space == single.action_space
    told, expected = play(native, steps), play(single, steps)
    native.close()
    return same(told, expected)
