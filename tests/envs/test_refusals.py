"""Tests that errors contain the value given and the allowed values."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import magfold_env as mf
from magfold_env.envs.anchor import AnchorEnv
from magfold_env.envs.reprogram import ReprogramEnv
from magfold_env.envs.tasks.feed_tasks import read_tasks
from magfold_env.envs.tray import TrayEnv
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.tube_feed_goal import TubeFeedGoalEnv
from magfold_env.envs.unknown_floor import UnknownFloorEnv
from tests.envs import test_anchor, test_tray
from tests.envs.test_unknown_floor import SEQUENCE, TASK

FEED = "MagFold/TubeFeed-v0"
TRAY, PULL, SOUND = test_tray.TASK, test_anchor.TASK, ((1.0,) * 4,) * 9
REFOLD = TASK | {"first": "LRLLR"}


def fed(**changes: Any) -> dict[str, mf.Scene]:
    return {"scene": mf.load_scene("tube-feed").replace(**changes)}


def many(**options: Any) -> Any:
    return gymnasium.make_vec(FEED, **{"num_envs": 2, "fidelity": "quasistatic"} | options)


@pytest.mark.parametrize(("make", "options", "message"), [
    (TubeFeedEnv, {"gamma": 1.5}, "gamma: 1.5 is not allowed; must be between 0 and 1"),
    (TubeFeedEnv, {"reward": "best"}, "reward: 'best' .*must be one of relative, score, spar"),
    (TubeFeedEnv, {"shaping": "speed"}, "shaping: 'speed' .*must be one of True, False, simil"),
    (TubeFeedEnv, {"baseline": "best"}, "baseline: 'best' .*must be one of auto, None"),
    (TubeFeedEnv, {"components": 6.5}, "components: 6.5 .*must be a whole number, from 2"),
    (TubeFeedEnv, {"components": "6"}, "components: '6' .*must be a whole number, from 2"),
    (TubeFeedEnv, {"targets": ["SSSSS"]}, "targets: 'SSSSS' .*must be a fully folded word"),
    (TubeFeedEnv, fed(mount="free"), "scene.mount: 'free' is not allowed"),
    (TubeFeedEnv, fed(feed={"loading": "preloaded"}), "scene.feed.loading: 'preloaded' is not"),
    (TubeFeedEnv, fed(magnets=None), "scene.magnets: None is not allowed"),
    (TubeFeedEnv, fed(sequence=("NSNS",)), r"scene.sequence: \('NSNS',\) is not allowed"),
    (TubeFeedEnv, fed(field={"uniform": (0.0, 1e-3)}), "baseline: 'auto' .*with scene.field"),
    (TubeFeedEnv, fed(field={"uniform": (0.0, 1e-3)}) | {"fidelity": "quasistatic"},
     r"field: .* is not allowed"),
    *(
        (TubeFeedGoalEnv, {key: None}, f"{key}: must be left out")
        for key in ("reward", "shaping", "gamma", "baseline")
    ),
    (UnknownFloorEnv, {"tasks": "none"}, "tasks: 'none' .*must be a list of tasks, the path"),
    (UnknownFloorEnv, {"tasks": "none.yaml"}, "tasks: 'none.yaml' .*must be a list of tasks, "),
    (UnknownFloorEnv, {"tasks": []}, r"tasks: chains of \[\] components are not allowed"),
    (UnknownFloorEnv, {"tasks": [TASK | {"target": "LLLLL"}]}, "tasks.target: 'LLLLL' is not"),
    (UnknownFloorEnv, {"tasks": [TASK, TASK | {"sequence": ["NX", *SEQUENCE[1:]]}]},
     r"sequence\[0\]: 'NX' is not allowed; must be four letters"),
    (UnknownFloorEnv, {"tasks": [TASK | {"direction": "up"}]}, "direction: 'up' is not allow"),
    (UnknownFloorEnv, {"fidelity": "quasistatic"}, "fidelity: .*must be 'dynamics'"),
    (ReprogramEnv, {"tasks": [REFOLD | {"first": "LLLLL"}]}, "tasks.first: 'LLLLL' is not all"),
    (ReprogramEnv, {"tasks": [REFOLD | {"target": "LLLLL"}]}, "tasks.target: 'LLLLL' is not a"),
    (ReprogramEnv, {"tasks": "two-folds-6"}, "first"),
    (TrayEnv, {"tasks": [TRAY | {"tray": ("NSNS",) * 5}]}, "tray: .* must have 6 components"),
    (TrayEnv, {"tasks": [TRAY | {"tray": ("NS-S",) * 9}]}, "tray: 'NS-S' is .*four letters"),
    (TrayEnv, {"tasks": [TRAY | {"target": "LLLLL"}]}, "tasks.target: 'LLLLL' is not allowed"),
    (TrayEnv, {"tasks": [TRAY | {"strengths": SOUND[1:]}]}, "strengths: .* must be 9 times"),
    (TrayEnv, {"tasks": [TRAY, TRAY | {"tray": TRAY["tray"][1:]}]}, "trays of .8, 9. comp"),
    (TrayEnv, {"scene": "tube-built"}, "scene.feed.loading: 'preloaded' .*must be 'at_m"),
    (AnchorEnv, {"tasks": [PULL | {"pull": 0.0}]}, "pull: 0.0 is not allowed; must be"),
    (AnchorEnv, {"tasks": [PULL | {"pull": np.inf}]}, "pull: inf is not allowed; must be"),
    (AnchorEnv, {"tasks": [PULL | {"towards": np.inf}]}, "towards: inf is not allowed; must"),
    (many, {"num_envs": 0}, "num_envs: 0 is not allowed; must be from 1"),
    (many, {"autoreset_mode": "Later"}, "autoreset_mode: 'Later' .*must be one of"),
    (many, {"threads": 0}, "threads: 0 is not allowed; must be from 1"),
    (many, {"render_mode": "human"}, "render_mode: 'human' .*with many environments"),
    (many, {"render_mode": "rgb_array_list"}, "render_mode: 'rgb_array_list' .*with many"),
    (many, {"speed": 3}, "argument 'speed'; must be one of scene, match"),
])  # fmt: skip
def test_wrong_options_are_named(make: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(**options)


def test_a_field_that_counts_needs_a_reward_without_a_baseline() -> None:
    scene = fed(field={"uniform": (0.0, 1e-3)})["scene"]
    assert TubeFeedEnv(scene, baseline=None).scene.field == scene.field
    assert TubeFeedEnv(scene.replace(field={"uniform": (0.0, 0.0)})).scene.n == 6


def test_a_task_of_two_words_is_none_of_one() -> None:
    with pytest.raises(ValueError, match="first"):
        read_tasks([REFOLD])


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"seed": [1]}, ValueError, "seed: 1 seeds are not allowed; must be one, or 2"),
    ({"options": {"goal": "LL"}}, ValueError, "options: 'goal' is not allowed; must be one of"),
    ({"options": {"target": "LLLLL"}}, ValueError, "'LLLLL' is not allowed; must be one of"),
    ({"options": {"target": ["LRLLL"]}}, ValueError, "1 words are not allowed; must be one"),
    ({"options": {"reset_mask": np.zeros(2, bool)}}, ValueError, "be true somewhere"),
    ({"options": {"reset_mask": np.ones(3, bool)}}, ValueError, r"must have shape \(2,\)"),
])  # fmt: skip
def test_wrong_resets_of_many_are_named(arguments, error, message):
    with pytest.raises(error, match=message):
        many().reset(**arguments)


@pytest.mark.parametrize(("make", "options", "message"), [
    (TubeFeedEnv, {"target": "LLLLL"}, r"options\['target'\]: 'LLLLL' .*must be one of"),
    (TubeFeedEnv, {"target": 3}, r"options\['target'\]: 3 is not allowed; must be one of"),
    (TubeFeedEnv, {"word": "LRLLL"}, "options: 'word' is not allowed; must be one of target"),
    (UnknownFloorEnv, {"task": 2000}, r"\['task'\]: 2000 is not allowed; must be from 0 to 1999"),
    (UnknownFloorEnv, {"target": "LRLLR"}, "options: 'target' .*must be one of task"),
])  # fmt: skip
def test_wrong_resets_are_named(make: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make().reset(options=options)


@pytest.mark.parametrize(("kind", "actions", "message"), [
    ("multidiscrete", [[1, 2]], r"shape \(1, 2\) is not allowed; must have shape \(2, 2\)"),
    ("multidiscrete", [[1, 2], [16, 2]], r"actions\[1\]: array\(\[16,  2\]\) is not allowed"),
    ("multidiscrete", [[1.0, 2.0]] * 2, "an array of float64 of shape"),
    ("discrete", [1, 144], r"actions\[1\]: .*144.* is not allowed; must be an integer, 0..143"),
    ("discrete", [[1], [2]], r"must have shape \(2,\)"),
    ("box", np.full((2, 5), 1.5), r"actions\[0\]: .* must be 5 numbers from -1 to 1"),
    ("box", np.full((2, 5), np.nan), r"actions\[0\]: .* must be 5 numbers from -1 to 1"),
])  # fmt: skip
def test_wrong_actions_of_many_are_named(kind: str, actions: Any, message: str) -> None:
    env = many(actions=kind)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(actions)


def test_a_step_needs_a_right_action_and_a_running_episode() -> None:
    env = TubeFeedEnv(baseline=None)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"action: .*16.* is not allowed"):
        env.step(np.array([16, 0]))
    assert env.next_component == 0
    env.step(np.array([15, 0]))
    assert env.next_component == 1
    with pytest.raises(RuntimeError, match="1 of 6 components are set"):
        env.to_scene()
    env = TubeFeedEnv(baseline=None)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0, 0]))
    env.reset(seed=0)
    for _ in range(6):
        env.step(np.array([6, 4]))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0, 0]))
    with pytest.raises(RuntimeError, match="every component has been fed"):
        _ = env.next_component


def test_stepping_many_needs_running_episodes() -> None:
    env = many(autoreset_mode=AutoresetMode.DISABLED, components=3)
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


def test_a_state_of_another_length_is_named() -> None:
    one, other = many(components=4), many(components=6)
    one.reset(seed=0)
    told = "'2 .* with 4 components in .*; must be get_state.. of 2 .* with 6 components in "
    with pytest.raises(ValueError, match=f"state: {told}"):
        other.set_state(one.get_state())
