from typing import Any, Literal

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS
from magfold_env.envs.chains.arrays import FOLDED, JAMMED, STATUSES
from magfold_env.envs.feed_control import HORIZON, INTERVAL, FeedControlEnv, replay
from magfold_env.envs.tasks.control_tasks import ControlTask, read_tasks
from magfold_env.envs.tasks.draws import randomised
from magfold_env.envs.tasks.make_control_tasks import DRAWS, count_words
from magfold_env.shapes import angles_to_word
from magfold_env.simulation.session import Session
from magfold_env.simulation.view import ChainState

SEQUENCE = ("NNNS", "NSSS", "NNNS", "SSNN", "SNNN", "SSSN")


def scene_of(**changes: Any) -> mf.Scene:
    scene = mf.load_scene("tube-built").replace(sequence=SEQUENCE, start_angles=(0.0,) * 5)
    return scene.replace(**changes)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_to_push_a_straight_chain_takes_the_drag_of_what_is_outside(direction: str) -> None:
    scene = scene_of(magnets=None, feed={"direction": direction})
    session = Session(scene)
    drag = scene.friction * scene.gravity.normal * scene.masses[0]
    assert session.push_force() == 0.0
    pushes = 0
    while session.released < session.n - 1:
        session.push(np.full(6, 0.1), 0.013)
        if session.released > 0 and session.push_force() != 0.0:
            assert session.push_force() == pytest.approx(drag * session.released)
            pushes += 1
    assert pushes > 10


@pytest.mark.parametrize("loading", ["preloaded", "at_mouth"])
def test_the_push_does_the_work_that_the_energies_gain(loading: str) -> None:
    # Without friction nothing is lost but in impacts: between them the balance is exact.
    scene = scene_of(
        friction=0.0,
        start_angles=(0.01, -0.02, 0.03, 0.01, -0.01),
        feed={"loading": loading},
        magnets={"remanence": 0.1},
        solver={"tolerance": 1e-9},
    )
    session = Session(scene)
    speed, interval = 0.1, 5e-5
    session.push(np.full(6, speed), 1.2 * scene.casing.diagonal / speed)
    assert session.released == 1

    def energy() -> float:
        masses, inertias = scene.masses[0], scene.inertias[0]
        state = ChainState(session.angles, session.rates, session.base, session.base_velocity)
        velocities = state.velocities(scene.casing.side)[: session.released]
        rates = state.rates[: session.released]
        kinetic = 0.5 * masses * np.sum(velocities**2) + 0.5 * inertias * np.sum(rates**2)
        return float(kinetic) + session.potential()

    before, work, force = energy(), 0.0, session.push_force()
    for _ in range(60):
        session.push(np.full(6, speed), interval)
        after = session.push_force()
        work += 0.5 * (force + after) * speed * interval
        force = after
    assert session.released == 1
    gained = energy() - before
    assert abs(gained) > 1e-8
    assert work == pytest.approx(gained, rel=1e-3)


def test_to_measure_a_force_changes_nothing() -> None:
    sessions = [Session(scene_of(start_angles=(0.01,) * 5)) for _ in range(2)]
    for _ in range(40):
        for session in sessions:
            session.push(np.full(6, 0.2), INTERVAL)
        sessions[0].push_force()
        np.testing.assert_array_equal(sessions[0].angles, sessions[1].angles)
        np.testing.assert_array_equal(sessions[0].rates, sessions[1].rates)


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("loading", ["preloaded", "at_mouth"])
def test_a_constant_speed_leads_to_the_fold_of_the_simulation(direction: str, loading: str) -> None:
    scene = scene_of(
        start_angles=(0.02, -0.01, 0.01, 0.0, -0.02),
        feed={"direction": direction, "loading": loading, "speed": 0.1},
    )
    end = mf.simulate(scene)
    arrays = replay(scene, [0.1] * 250).arrays
    joints = np.diff(arrays.angles[0])
    assert STATUSES[arrays.status[0]] == end.status
    assert angles_to_word(joints) == end.word
    # Steps of the integrator end every 20 ms, so the last bits differ.
    np.testing.assert_allclose(joints, end.joint_angles, atol=1e-2)


def test_standing_still_goes_nowhere_until_it_is_truncated() -> None:
    env = FeedControlEnv()
    env.reset(seed=0)
    for step in range(HORIZON):
        _, reward, terminated, truncated, info = env.step(0)
        assert reward == 0.0
        assert not terminated
        assert truncated == (step == HORIZON - 1)
        assert info["time"] == pytest.approx(0.02 * (step + 1))
        assert "status" not in info
    assert env.state.base.tolist() == [0.0, 0.0] or env.task.direction == "backward"


def test_episodes_replay_bit_for_bit() -> None:
    env = FeedControlEnv(randomisation="strong")
    rng = np.random.default_rng(1)
    for seed in range(3):
        env.reset(seed=seed)
        ended = False
        while not ended:
            _, _, terminated, truncated, _ = env.step(rng.integers(3, 10))
            ended = terminated or truncated
        again = replay(env.to_scene(), env.history).arrays
        np.testing.assert_array_equal(again.angles[0], env.state.angles)
        np.testing.assert_array_equal(again.base[0], env.state.base)


def test_a_weak_push_jams() -> None:
    weak = replay(scene_of(feed={"force_limit": 0.02}), [0.1] * 250)
    assert weak.arrays.status[0] == JAMMED
    assert "the drive slipped for 0.1 s" in weak.message(0)
    strong = replay(scene_of(), [0.1] * 250)
    assert strong.arrays.status[0] == FOLDED
    env = FeedControlEnv(push_limit=0.001, randomisation="none")
    env.reset(seed=0)
    ended, info = False, {}
    while not ended:
        *_, ended, _, info = env.step(7)
    assert info["status"] == "jammed"
    assert not info["is_success"]
    assert 0.0 <= info["score"] <= 0.5


def fold_at(env: FeedControlEnv, number: int, level: int) -> tuple[float, dict]:
    env.reset(seed=0, options={"task": number})
    ended, reward, info = False, 0.0, {}
    while not ended:
        _, reward, terminated, truncated, info = env.step(level)
        ended = terminated or truncated
    return float(reward), info


@pytest.mark.parametrize("reward", ["score", "sparse"])
def test_the_target_is_worth_one_and_the_other_fold_nothing(
    reward: Literal["score", "sparse"],
) -> None:
    env = FeedControlEnv(randomisation="none", reward=reward)
    seen = set()
    for number in (0, len(env.tasks) - 1):
        for level in (3, 6, 9):
            value, info = fold_at(env, number, level)
            if info.get("status") == "folded" and info["word"] == info["target"]:
                assert value == 1.0
                seen.add("target")
            elif info.get("status") == "folded" and info["word"] == info["avoid"]:
                assert value == 0.0
                seen.add("avoid")
    assert seen == {"target", "avoid"}


def test_the_observation_says_how_the_feed_stands() -> None:
    env = FeedControlEnv(randomisation="none")
    observation, _ = env.reset(seed=0, options={"task": 0})
    group = env.layout.slices["feed"]
    direction = 1.0 if env.tasks[0].direction == "forward" else -1.0
    assert observation[group].tolist() == [direction, 0.0, 0.0, 0.0, 0.0]
    signs = [1.0 if f == "N" else -1.0 for faces in env.tasks[0].sequence for f in faces]
    assert observation[env.layout.slices["magnets"]].tolist() == signs
    observation, *_ = env.step(5)
    speed = env.actions.speeds[5]
    out = speed * INTERVAL / env.scene.casing.diagonal
    np.testing.assert_allclose(
        observation[group], [direction, out, speed / 0.6, 0.0, 1 / HORIZON], rtol=1e-5
    )


@pytest.mark.parametrize("shaping", ["similarity", "energy"])
def test_shaping_changes_the_return_by_the_first_potential_alone(shaping: Any) -> None:
    shaped = FeedControlEnv(randomisation="none", shaping=shaping)
    plain = FeedControlEnv(randomisation="none")
    total = 0.0
    for env in (shaped, plain):
        env.reset(seed=0, options={"task": 0})
    first = shaped.episodes.potential(np.array([0]))[0]
    ended = False
    while not ended:
        *_, ended, _, _ = step = shaped.step(6)
        total += step[1] - plain.step(6)[1]
    assert total == pytest.approx(-first)


def test_shipped_tasks_are_chains_with_two_folds() -> None:
    tasks = read_tasks("two-folds-6")
    assert len(tasks) == 40
    pairs = {
        (task.sequence, task.direction, frozenset((task.target, task.avoid))) for task in tasks
    }
    assert len(pairs) == 20
    assert {task.direction for task in tasks} == {"forward", "backward"}


@pytest.mark.parametrize("number", [0, -1])
def test_both_folds_of_a_shipped_task_can_be_had(number: int) -> None:
    task = read_tasks("two-folds-6")[number]
    scene = mf.load_scene("tube-built").replace(
        sequence=task.sequence, feed={"direction": task.direction}
    )
    counts = [count_words(randomised(scene, "nominal"), speed) for speed in CANDIDATE_SPEEDS]
    for word in (task.target, task.avoid):
        assert max(count[word] for count in counts) >= 0.75 * DRAWS


TASK = {"sequence": SEQUENCE, "direction": "forward", "target": "LRLLR", "avoid": "LRRLR"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tasks": "none"}, "tasks: 'none' is not allowed; must be a list of tasks or one of two"),
        ({"tasks": []}, r"tasks: chains of \[\] components are not allowed"),
        ({"tasks": [TASK | {"target": "LLLLL"}]}, "tasks.target: 'LLLLL' is not allowed; must be"),
        ({"tasks": [TASK | {"avoid": "LRLLR"}]}, "tasks.avoid: 'LRLLR' is not allowed; must dif"),
        ({"tasks": [TASK | {"direction": "up"}]}, "direction: 'up' is not allowed"),
        ({"push_limit": 0.0}, "push_limit: 0.0 is not allowed; must be above 0, or None"),
        ({"fidelity": "quasistatic"}, "fidelity: 'quasistatic' is not allowed; must be 'dynamics'"),
        ({"reward": "relative"}, "reward: 'relative' is not allowed; must be score or sparse"),
    ],
)
def test_wrong_options_are_named(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FeedControlEnv(**options)


def test_wrong_reset_options_are_named() -> None:
    env = FeedControlEnv(tasks=[TASK])
    with pytest.raises(ValueError, match=r"options\['task'\]: 1 is not allowed; must be 0\.\.0"):
        env.reset(options={"task": 1})
    with pytest.raises(ValueError, match="options: 'target' is not allowed; must be 'task'"):
        env.reset(options={"target": "LRLLR"})


def test_difficulty_takes_the_first_tasks() -> None:
    assert len(FeedControlEnv(difficulty=0.1).tasks) == 4
    assert FeedControlEnv(difficulty=0.1).tasks == FeedControlEnv().tasks[:4]


def test_an_episode_counts_the_components_that_act() -> None:
    env = FeedControlEnv("tube-feed")
    env.reset(seed=0)
    episodes: Any = env.episodes
    assert env.scene.feed.loading == "at_mouth"
    assert episodes.acting(0) == 0
    env.step(6)
    assert episodes.acting(0) == 1
    built: Any = FeedControlEnv()
    built.reset(seed=0)
    assert built.episodes.acting(0) == 6


def test_tasks_may_be_given_as_models_or_mappings() -> None:
    assert read_tasks([TASK]) == read_tasks([ControlTask(**TASK)])
