"""Wrong arguments of vector environments are refused with what was given and what is allowed."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import magfold_env  # noqa: F401 - registers the environments

FEED = "MagFold/TubeFeed-v0"


def made(**options: Any) -> Any:
    return gymnasium.make_vec(FEED, **{"num_envs": 2, "fidelity": "quasistatic"} | options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"num_envs": 0}, "num_envs: 0 is not allowed; must be at least 1"),
        ({"autoreset_mode": "Later"}, "autoreset_mode: 'Later' is not allowed; must be one of"),
        ({"threads": 0}, "threads: 0 is not allowed; must be at least 1"),
        ({"render_mode": "human"}, "render_mode: 'human' is not allowed with many environments"),
        ({"render_mode": "rgb_array_list"}, "render_mode: 'rgb_array_list' is not allowed with ma"),
        ({"speed": 3}, "speed: unknown option, must be one of scene, match"),
        ({"reward": "big"}, "reward: 'big' is not allowed; must be one of relative, score"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        made(**options)


@pytest.mark.parametrize(
    ("kind", "actions", "message"),
    [
        ("multidiscrete", [[1, 2]], r"shape \(1, 2\) is not allowed; must have shape \(2, 2\)"),
        ("multidiscrete", [[1, 2], [16, 2]], r"actions\[1\]: array\(\[16,  2\]\) is not allowed"),
        ("multidiscrete", [[1.0, 2.0]] * 2, "an array of float64 of shape"),
        ("discrete", [1, 144], r"actions\[1\]: .*144.* is not allowed; must be an integer, 0..143"),
        ("discrete", [[1], [2]], r"must have shape \(2,\)"),
        ("box", np.full((2, 5), 1.5), r"actions\[0\]: .* must be 5 numbers from -1 to 1"),
        ("box", np.full((2, 5), np.nan), r"actions\[0\]: .* must be 5 numbers from -1 to 1"),
    ],
)
def test_wrong_actions_are_refused(kind: str, actions: Any, message: str) -> None:
    env = made(actions=kind)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(actions)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"seed": [1]}, ValueError, "seed: 1 seeds are not allowed; must be one, or 2"),
        ({"options": {"goal": "LL"}}, ValueError, "options: 'goal' is not allowed; must be one of"),
        ({"options": {"target": "LLLLL"}}, ValueError, "'LLLLL' is not allowed; must be one of"),
        ({"options": {"target": ["LRLLL"]}}, ValueError, "1 words are not allowed; must be one"),
        ({"options": {"reset_mask": [True, False]}}, TypeError, "must be an array of bool"),
        ({"options": {"reset_mask": np.zeros(2, bool)}}, ValueError, "be true somewhere"),
        ({"options": {"reset_mask": np.ones(3, bool)}}, ValueError, r"must have shape \(2,\)"),
    ],
)
def test_wrong_resets_are_refused(arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        made().reset(**arguments)


def test_episodes_must_have_begun() -> None:
    env = made(autoreset_mode=AutoresetMode.DISABLED, components=3)
    actions = np.zeros((2, 2), dtype=np.int64)
    for ask in (env.get_state, env.render, lambda: env.step(actions)):
        with pytest.raises(gymnasium.error.ResetNeeded, match="no episode has begun"):
            ask()
    env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gymnasium.error.ResetNeeded, match="no episode has begun"):
        env.step(actions)
    env.reset()
    for _ in range(3):
        env.step(actions)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"environments \[0, 1\] are over"):
        env.step(actions)
