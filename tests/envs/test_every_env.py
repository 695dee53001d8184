"""Tests of every environment, single and in a vector, with every form of actions."""

import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import RescaleAction, TimeAwareObservation
from gymnasium.wrappers import vector as vector_wrappers

import magfold_env
from magfold_env.engine.compile.jit import numba_config
from magfold_env.envs import ENTRY_POINTS, VECTOR_ENTRY_POINTS, register_envs
from magfold_env.envs.camera_track import TIME_COST
from magfold_env.scoring.track import TRACKS
from tests.envs import contract
from tests.envs.vectors import alike, kinds_of

MOST_FILES = 8
"""Largest number of Python files whose code the step of an environment runs."""

SPACES = contract.SINGLE[:2]
"""Rules that depend on the action space; the others are tested with the default one."""


def variants(*kinds: str) -> list[Any]:
    """Return every ID with some of its action spaces (by default all) and its fidelities."""
    found = []
    for env_id in ENTRY_POINTS:
        for kind in kinds or kinds_of(env_id):
            for fidelity in ("dynamics", "quasistatic"):
                options: dict[str, Any] = {"fidelity": fidelity}
                if kind != "default":
                    options["actions"] = kind
                if env_id in TRACKS and fidelity == "quasistatic":
                    continue
                if env_id not in TRACKS:
                    # Short chains fold fast, and `discrete` cannot have longer sequences.
                    options["components"] = 3
                if env_id in ("MagFold/TubeFeed-v0", "MagFold/SequenceDesign-v0"):
                    options["baseline"] = None
                name = f"{env_id.split('/')[1]}-{kind}-{fidelity}"
                found.append(pytest.param(env_id, options, id=name))
    return found


every_variant = pytest.mark.parametrize(("env_id", "options"), variants())
every_fidelity = pytest.mark.parametrize(("env_id", "options"), variants("default"))
every_id = pytest.mark.parametrize("env_id", list(ENTRY_POINTS))


@pytest.mark.parametrize("hold", SPACES, ids=contract.name_of)
@every_variant
def test_every_way_to_write_actions_keeps_the_contract(env_id, options, hold):
    hold(env_id, options)


@pytest.mark.parametrize("hold", contract.SINGLE[2:], ids=contract.name_of)
@every_fidelity
def test_every_environment_keeps_the_contract(env_id, options, hold):
    hold(env_id, options)


@pytest.mark.parametrize("mode", AutoresetMode)
@every_fidelity
def test_many_say_what_single_ones_do(env_id, options, mode):
    contract.many_are_as_single_ones(env_id, options, mode)


@every_variant
def test_many_read_actions_as_single_ones_do(env_id: str, options: dict[str, Any]) -> None:
    contract.many_are_as_single_ones(env_id, options, AutoresetMode.SAME_STEP)


@pytest.mark.parametrize("shaping", ["similarity", "energy"])
@every_id
def test_shaping_changes_the_discounted_return_by_the_first_potential_alone(env_id, shaping):
    if "Goal" in env_id:
        pytest.skip("has no shaping")
    options = {} if env_id in TRACKS else {"baseline": None}
    assert contract.shapes_by_the_first_potential_alone(env_id, shaping, options)


@every_id
def test_steps_on_the_way_are_all_worth_the_same_without_shaping(env_id: str) -> None:
    said = contract.play(contract.made(env_id, {}), 2)
    rewards, info = [each[1] for each in said[1:]], said[-1][-1]
    if env_id not in TRACKS:
        wanted = -1.0 if "Goal" in env_id else 0.0
        assert rewards[:-1] == [wanted] * (len(rewards) - 1)
        assert -1.0 <= rewards[-1] <= 1.0
        return
    times = np.array([each[-1]["time"] for each in said])
    np.testing.assert_allclose(rewards[:-1], -TIME_COST * np.diff(times)[:-1])
    assert sum(rewards) == pytest.approx(info["score"] - TIME_COST * info["time"])


@every_id
@pytest.mark.parametrize(("options", "message"), [
    ({"actions": "dict"}, "actions: 'dict' is not allowed; must be one of multidiscrete"),
    ({"speeds": 1}, "speeds: 1 is not allowed; must be from 2"),
    ({"speeds": 2.5}, "speeds: 2.5 is not allowed; must be a whole number, from 2"),
    ({"difficulty": "x"}, "difficulty: 'x' is not allowed; must be a number, greater than 0"),
    ({"difficulty": 0.0}, "difficulty: 0.0 is not allowed; must be greater than 0 and at most 1"),
    ({"fidelity": "exact"}, "fidelity: 'exact' is not allowed; must be"),
    ({"match": "cells"}, "match: 'cells' is not allowed; must be one of word, outline"),
    ({"randomisation": "wild"}, "randomisation: 'wild' is not allowed; must be one of none"),
    ({"render_mode": "video"}, "render_mode: 'video' is not allowed; must be one of None, hum"),
    ({"target": "LRLLL"}, "unexpected keyword argument 'target'; must be one of scene, "),
    ({"randomization": "none"}, "must be one of .*; did you mean randomisation"),
    ({"scene": "tube-fed"}, "tube-fed: no such scene"),
    ({"scene": "missing.yaml"}, "missing.yaml: no such file"),
    ({"scene": "pendulum-3"}, "scene.mount: 'pinned' is not allowed; must be 'tube'"),
])  # fmt: skip
def test_wrong_options_are_named(env_id: str, options: dict, message: str) -> None:
    for entry_points in (ENTRY_POINTS, VECTOR_ENTRY_POINTS):
        module, name = entry_points[env_id].split(":")
        make = getattr(__import__(module, fromlist=[name]), name)
        with pytest.raises(ValueError, match=message):
            make(**options)


def test_registering_again_changes_nothing() -> None:
    specs = [gymnasium.spec(env_id) for env_id in ENTRY_POINTS]
    register_envs()
    for env_id, spec in zip(ENTRY_POINTS, specs, strict=True):
        assert gymnasium.spec(env_id) is spec
        assert spec.max_episode_steps is None


@every_id
def test_libraries_find_out_that_an_option_is_unknown(env_id: str) -> None:
    """Some libraries try keywords of other environments and expect the text of Python's error."""
    wanted = "got an unexpected keyword argument 'frameskip'; must be one of scene, "
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(TypeError, match=wanted) as caught:
            make(env_id, frameskip=4)
        assert isinstance(caught.value, ValueError)


HORIZONS: dict[str, Any] = {
    "MagFold/TubeFeed-v0": 6,
    "MagFold/SequenceDesign-v0": 1,
    "MagFold/TubeFeedGoal-v0": 6,
    "MagFold/UnknownFloor-v0": 250,
    "MagFold/UnknownFloor-v1": 250,
    "MagFold/Reprogram-v0": 500,
    "MagFold/Lumen-v0": 250,
}
"""Default numbers of steps; the other environments only limit simulated time."""


def limit_of(env: Any) -> int | None:
    """Return the step limit in the spec of an environment or a vector environment."""
    return env.spec.max_episode_steps


@every_id
def test_a_spec_has_a_limit_that_no_episode_reaches(env_id: str) -> None:
    horizon = HORIZONS.get(env_id)
    env: Any = gymnasium.make(env_id)
    envs: Any = gymnasium.make_vec(env_id, num_envs=2)
    assert env.unwrapped.horizon == envs.template.horizon == horizon
    again = gymnasium.make(env.spec), gymnasium.make_vec(env.spec, num_envs=2)
    for each in (env, envs, *again):
        assert limit_of(each) == (None if horizon is None else horizon + 1)
    for each in (gymnasium.make, gymnasium.make_vec):
        assert limit_of(each(env_id, max_episode_steps=9)) == 9


@pytest.mark.parametrize(
    ("env_id", "options", "horizon"),
    [
        *((env_id, {}, horizon) for env_id, horizon in HORIZONS.items()),
        ("MagFold/TubeFeed-v0", {"components": 8}, 8),
        ("MagFold/SequenceDesign-v0", {"components": 8}, 1),
    ],
)
def test_the_end_of_a_task_is_no_truncation(
    env_id: str, options: dict[str, Any], horizon: int
) -> None:
    spec: Any = gymnasium.make(env_id, **options).spec
    env = TimeAwareObservation(gymnasium.make(spec), flatten=False)
    envs = gymnasium.make_vec(spec, num_envs=1)
    space: Any = env.action_space
    still = np.zeros(space.shape, space.dtype)
    env.reset(seed=0)
    envs.reset(seed=0)
    for step in range(1, horizon + 1):
        observation, _, terminated, truncated, _ = env.step(still)
        assert (terminated, truncated) == (step == horizon, False)
        assert observation["time"] == step
        assert observation in env.observation_space
        _, _, terminated, truncated, _ = envs.step(still[None])
        assert (terminated[0], truncated[0]) == (step == horizon, False)


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("limit", [1, 3, -1])
def test_a_limit_from_outside_truncates_many_as_single_ones(
    mode: AutoresetMode, limit: int
) -> None:
    for components in (2, 3):  # the task ends before the limit, or with it
        options = {"fidelity": "quasistatic", "components": components}
        assert alike("MagFold/TubeFeed-v0", 3, mode, 9, max_episode_steps=limit, **options)
    assert alike("MagFold/Tray-v0", 2, mode, 9, max_episode_steps=limit)


def test_a_limit_from_outside_is_part_of_a_state() -> None:
    env: Any = gymnasium.make_vec("MagFold/UnknownFloor-v0", num_envs=2, max_episode_steps=3)
    env.reset(seed=0)
    still = np.zeros((2, 1), dtype=np.float32)
    env.step(still)
    state = env.get_state()
    for _ in range(2):
        assert not env.step(still)[3].any()
        assert env.step(still)[3].all()
        env.set_state(state)
    with pytest.raises(ValueError, match="max_episode_steps: 0 is not allowed; must be at least 1"):
        gymnasium.make_vec("MagFold/UnknownFloor-v0", max_episode_steps=0)


def test_rescaled_actions_may_reach_the_bounds() -> None:
    bounds = np.array([[-0.5], [0.2]], dtype=np.float32)
    one = RescaleAction(gymnasium.make("MagFold/UnknownFloor-v0"), *bounds)
    envs = gymnasium.make_vec("MagFold/UnknownFloor-v0", num_envs=2)
    many = vector_wrappers.RescaleAction(envs, *bounds)
    one.reset(seed=0)
    many.reset(seed=0)
    assert one.func(bounds[1]) > 1.0  # by rounding
    one.step(bounds[1])
    many.step(np.stack([bounds[1]] * 2))


@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="nothing is compiled")
@every_id
def test_a_step_can_be_read_in_few_files(env_id: str) -> None:
    package, found = Path(magfold_env.__file__).parent, set[str]()

    def note(frame: Any, event: str, _: object) -> None:
        code = frame.f_code
        is_python = "__name__" in frame.f_globals  # frames of kernels are empty
        if event == "call" and is_python and package in Path(code.co_filename).parents:
            found.add(str(Path(code.co_filename).relative_to(package)))

    env = contract.made(env_id, {})
    contract.play(env, 0)
    env.reset(seed=1)
    action = env.action_space.sample()
    sys.setprofile(note)
    try:
        over = env.step(action)[2]
    finally:
        sys.setprofile(None)
    # How kernels are called is no part of the environment; how an episode ends is in files of its
    # own.
    files = {each for each in found if not each.startswith("engine")}
    assert len(files) <= MOST_FILES + 2 * over, files
