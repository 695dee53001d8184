"""Tests of what tracks show: the options `sight` and `reveal`."""

import re
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from agents.settings import TrainSettings, checked
from magfold_env.envs.anchor import AnchorEnv
from magfold_env.envs.camera_track import CameraTrackEnv
from magfold_env.envs.chains.dynamic import REFERENCE_SPEED
from magfold_env.envs.lumen import LumenEnv
from magfold_env.envs.reprogram import ReprogramEnv
from magfold_env.envs.spaces.actions import PULL
from magfold_env.envs.spaces.observation import take_frames
from magfold_env.envs.tray import TrayEnv
from magfold_env.envs.unknown_floor import UnknownFloorEnv
from magfold_env.envs.wrappers import vector
from magfold_env.envs.wrappers.canonical import CanonicalObservation
from magfold_env.scene import load_scene
from magfold_env.scoring.track import TRACKS
from tests.envs.contract import group
from tests.envs.vectors import alike

SIGHTS = ("camera", "exact", "none")
MEASURED = ("seen", "heading", "position", "force", "borne")
every_track = pytest.mark.parametrize(
    "make", [UnknownFloorEnv, ReprogramEnv, LumenEnv, TrayEnv, AnchorEnv]
)


def action_of(env: Any, step: int) -> Any:
    if env.action_space.shape == (1,):
        return np.array([0.9 if step % 40 < 30 else -0.7], dtype=np.float32)
    return np.array([step % 9, step % 8, 4, (0, 0, 1, PULL)[step % 4] % env.action_space.nvec[3]])


def episode(env: Any, seed: int = 3, steps: int = 60) -> tuple[list[Any], list[Any], list[Any]]:
    """Return observations, states and rewards of an episode."""
    seen, states, rewards = [env.reset(seed=seed)[0]], [env.state], []
    for step in range(steps):
        observation, reward, over, *_ = env.step(action_of(env, step))
        seen.append(observation)
        states.append(env.state)
        rewards.append(reward)
        if over:
            break
    return seen, states, rewards


def frame_of(env: Any) -> Any:
    """Return the camera's frame of the current state, without noise."""
    frames, n = np.zeros((1, 5 * env.layout.n)), env.layout.n
    take_frames(env.layout.side, np.array([0]), env.episodes.arrays, np.zeros((1, 3 * n)), frames)
    return frames[0].astype(np.float32)


@every_track
def test_episodes_are_the_same_for_every_sight(make: type[CameraTrackEnv]) -> None:
    envs: list[Any] = [make(), *(make(sight=sight) for sight in SIGHTS)]
    usual, *others = [episode(env) for env in envs]
    for env, other in zip(envs[1:], others, strict=True):
        assert env.observation_space == envs[0].observation_space
        assert usual[2] == other[2]
        for one, two in zip(usual[1], other[1], strict=True):
            np.testing.assert_equal(vars(one), vars(two))
        for name in env.layout.sizes.keys() - {*MEASURED}:
            span = env.layout.slices[name]
            for one, two in zip(usual[0], other[0], strict=True):
                np.testing.assert_array_equal(one[span], two[span])
    np.testing.assert_array_equal(usual[0], others[0][0])
    for env in envs:
        env.reset()
        np.testing.assert_equal(vars(env.state), vars(envs[0].state))


@every_track
def test_exact_sight_is_the_present_state(make: type[CameraTrackEnv]) -> None:
    env: Any = make(sight="exact")
    observation, info = env.reset(seed=1)
    forces, impulse, time = [info["force"]], 0.0, 0.0
    for step in range(40):
        np.testing.assert_array_equal(observation[env.layout.frame], frame_of(env))
        observation, _, over, _, info = env.step(action_of(env, step))
        now = env.episodes.chains.impulses(env.episodes.rows)[0]
        is_test = make is AnchorEnv and env.episodes.is_tested(env.episodes.rows)[0]
        if not is_test and not over:
            mean = (now - impulse) / (info["time"] - time)
            assert info["force"] == pytest.approx(mean, rel=1e-9, abs=1e-12)
        squashed = info["force"] / 0.1 / (1.0 + abs(info["force"] / 0.1))
        assert group(env, observation, "force") == pytest.approx(squashed)
        impulse, time = now, info["time"]
        forces.append(info["force"])
        if over:
            break
    assert forces[0] == 0.0
    assert np.any(forces)


@every_track
def test_without_sight_all_that_is_measured_is_zero(make: type[CameraTrackEnv]) -> None:
    env: Any = make(sight="none")
    seen = np.array(episode(env)[0])
    for name in env.layout.slices.keys() & {*MEASURED}:
        assert not seen[:, env.layout.slices[name]].any()
    for name in env.layout.slices.keys() & {"speed", "time", "magnets"}:
        assert seen[:, env.layout.slices[name]].any()


def test_a_revealed_floor_is_the_drawn_scene() -> None:
    env: Any = UnknownFloorEnv(reveal="physics")
    for seed in range(4):
        shown = group(env, env.reset(seed=seed)[0], "physics").astype(np.float64)
        drawn, given = env.episodes.chains.drawn(0), env.scene
        friction, strength, speed = shown[:3]
        assert np.log10(drawn.frictions / given.frictions) == pytest.approx(
            0.650515 * friction, abs=1e-6
        )
        np.testing.assert_allclose(drawn.speeds / REFERENCE_SPEED, 1.0 + 0.6 * speed, rtol=1e-6)
        each = (1.0 + 0.3 * strength) * (1.0 + 0.15 * shown[3:].reshape(6, 4))
        charges = env.episodes.chains.strengths[0] / given.magnets.charges(6)
        np.testing.assert_allclose(charges, each, rtol=1e-6)


def test_a_revealed_chamber_and_slope_are_those_drawn() -> None:
    spreads = load_scene("lumen").spreads.model_copy(update={"tilt": 10.0, "mass": 0.2})
    scene = load_scene("lumen").replace(spreads=spreads)
    env: Any = LumenEnv(scene, reveal="physics")
    shown = group(env, env.reset(seed=2)[0], "physics").astype(np.float64)
    assert shown.size == 1 + 6 + 1 + 24 + 2 + 2
    drawn = env.episodes.scene(0)
    np.testing.assert_allclose(drawn.masses / scene.masses, 1.0 + 0.2 * shown[1:7], rtol=1e-6)
    width, offset, angle, towards = shown[-4:]
    y = [each.position[1] for each in drawn.obstacles]
    np.testing.assert_allclose(
        y, 0.025 * (1.0 + 0.2 * width) * np.array([1.0, -1.0]) + 0.01 * offset, rtol=1e-6
    )
    pull = scene.gravity.normal * np.sin(np.radians(10.0) * angle)
    np.testing.assert_allclose(
        drawn.gravity.in_plane, [pull * np.cos(np.pi * towards), pull * np.sin(np.pi * towards)],
        atol=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("make", [TrayEnv, AnchorEnv])
def test_revealed_magnets_of_a_tray_are_those_drawn(make: type[CameraTrackEnv]) -> None:
    env: Any = make(reveal="physics")
    shown = group(env, env.reset(seed=0)[0], "physics")
    np.testing.assert_allclose(shown[2:] + 1.0, env.episodes.strengths[0].ravel(), atol=1e-6)
    assert (shown[2:] == -1.0).any()
    sound: Any = make(reveal="physics", randomisation="none")
    assert not group(sound, sound.reset(seed=0)[0], "physics").any()
    strong = tuple([(5.0, 1.0, 0.5, 0.0)] * sound.actions.parts)
    task = sound.tasks[0].model_copy(update={"strengths": strong})
    sound = make(tasks=[task], reveal="physics", randomisation="none")
    shown = sound.reset(seed=0)[0]
    assert shown in sound.observation_space
    assert group(sound, shown, "physics")[:4].tolist() == [1.0, 0.0, -0.5, -1.0]


@every_track
def test_what_is_revealed_comes_last_and_lasts(make: type[CameraTrackEnv]) -> None:
    usual, env = make(), make(reveal="physics", sight="none")
    size = usual.layout.size
    assert env.layout.slices["physics"] == slice(size, env.layout.size)
    assert list(env.layout.sizes)[:-1] == list(usual.layout.sizes)
    seen = np.array(episode(env)[0])
    assert (np.abs(seen) <= 1.0).all()
    assert seen[0, size:].any()
    np.testing.assert_array_equal(seen[:, size:], np.repeat(seen[:1, size:], len(seen), axis=0))
    assert not np.array_equal(seen[0, size:], env.reset(seed=4)[0][size:])
    plain = np.array(episode(make(sight="none"))[0])
    np.testing.assert_array_equal(seen[:, :size], plain)


@pytest.mark.parametrize("sight", SIGHTS)
@pytest.mark.parametrize("env_id", TRACKS)
def test_many_show_what_single_ones_do(env_id: str, sight: str) -> None:
    mode = AutoresetMode.SAME_STEP
    assert alike(env_id, 3, mode, 25, sight=sight, reveal="physics")


def test_a_state_contains_what_is_revealed() -> None:
    first, second = (TrayEnv(reveal="physics", sight="exact") for _ in range(2))
    first.reset(seed=0)
    seen = first.step(action_of(first, 0))[0]
    second.reset(seed=1)
    np.testing.assert_array_equal(second.set_state(first.get_state())[0], seen)


@every_track
@pytest.mark.parametrize(("options", "message"), [
    ({"sight": "blind"}, "sight: 'blind' is not allowed; must be one of camera, exact, none"),
    ({"sight": None}, "sight: None is not allowed; must be one of camera, exact, none"),
    ({"reveal": "all"}, "reveal: 'all' is not allowed; must be one of None, physics"),
    ({"reveal": True}, "reveal: True is not allowed; must be one of None, physics"),
])  # fmt: skip
def test_wrong_values_are_named(make: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(**options)


def test_the_canonical_view_refuses_what_it_cannot_permute() -> None:
    message = "reveal: 'physics' is not allowed; must be None in the canonical view"
    with pytest.raises(ValueError, match=message):
        CanonicalObservation(UnknownFloorEnv(reveal="physics"))
    envs: Any = gymnasium.make_vec("MagFold/Lumen-v0", num_envs=2, reveal="physics")
    with pytest.raises(ValueError, match=message):
        vector.CanonicalObservation(envs)
    assert CanonicalObservation(UnknownFloorEnv(sight="none")).reset(seed=0)[0].any()


def test_training_settings_have_these_options() -> None:
    env = {"id": "MagFold/UnknownFloor-v1", "sight": "exact", "reveal": "physics"}
    settings = checked(TrainSettings, {"name": "a", "env": env}, "settings")
    assert settings.env.options() == {"sight": "exact", "reveal": "physics"}
    learner = {"algorithm": "ppo", "view": "canonical"}
    for content, message in (
        ({"env": env | {"sight": "far"}}, "env.sight: 'far' is not allowed"),
        ({"env": env, "learner": learner}, "env.reveal: 'physics' is not allowed; must be left"),
    ):
        with pytest.raises(ValueError, match=re.escape(message)):
            checked(TrainSettings, {"name": "a", **content}, "settings")
