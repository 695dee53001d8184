"""Tests of `UnknownFloor`: a chain is fed back and forth, and hidden physics stays hidden."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.lists.feed_tasks import DRAWS, count_words
from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS
from magfold_env.envs.camera_track import FORCE_SCALE, INTERVAL, STEEPEST, TIME_COST, replay
from magfold_env.envs.chains.arrays import FOLDED, JAMMED, STATUSES
from magfold_env.envs.spaces.actions import FASTEST
from magfold_env.envs.tasks.draws import randomised
from magfold_env.envs.tasks.feed_tasks import FeedTask, read_tasks
from magfold_env.envs.unknown_floor import HORIZON, UnknownFloorEnv
from magfold_env.shapes import angles_to_word
from tests.envs.contract import group

SEQUENCE = ("NNNS", "NSSS", "NNNS", "SSNN", "SNNN", "SSSN")
TASK = {"sequence": SEQUENCE, "direction": "forward", "target": "LRLLR"}


def scene_of(**changes: Any) -> mf.Scene:
    scene = mf.load_scene("tube-built").replace(sequence=SEQUENCE, start_angles=(0.0,) * 5)
    return scene.replace(**changes)


def play(env: UnknownFloorEnv, speeds: Any, seed: int = 0, task: int = 0) -> list[Any]:
    """Feed at some speeds [m/s], with the last one until the end; return all results."""
    said: list[Any] = [env.reset(seed=seed, options={"task": task})]
    speeds, ended = list(speeds), False
    while not ended:
        speed = speeds.pop(0) if len(speeds) > 1 else speeds[0]
        said.append(env.step(env.actions.encode(speed)))
        ended = said[-1][2]
        assert not said[-1][3]
    return said


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


@pytest.mark.parametrize("speed", [0.0, -0.6])
def test_a_chain_that_stays_in_its_tube_is_late(speed: float) -> None:
    env = UnknownFloorEnv()
    said = play(env, [speed])
    assert len(said) == HORIZON + 1
    for step, (observation, reward, terminated, _, info) in enumerate(said[1:], 1):
        assert reward == pytest.approx(-TIME_COST * INTERVAL)
        assert terminated == (step == HORIZON)
        assert info["time"] == pytest.approx(0.02 * step)
        assert group(env, observation, "advance") == 0.0
        assert not observation[env.setup.layout.frame].any()
    info = said[-1][-1]
    assert (info["status"], info["score"], info["is_success"]) == ("unsettled", 0.0, False)
    assert info["message"] == "late: not at rest and all out after 5 s"


def test_every_speed_that_can_be_asked_for_empties_the_tube() -> None:
    env = UnknownFloorEnv(actions="discrete")
    for speed in env.actions.speeds[env.actions.speeds > 0.0]:
        said = play(env, [float(speed)])
        assert said[-1][0][env.layout.slices["advance"]] == 1.0


def test_the_drive_changes_its_speed_so_much_a_step() -> None:
    env = UnknownFloorEnv()
    play(env, [0.6, 0.6, 0.6, 0.6, -0.6])
    changes = np.diff(env.history, prepend=0.0)
    assert np.abs(changes).max() == pytest.approx(STEEPEST)
    assert max(env.history) == pytest.approx(FASTEST)


def test_components_are_held_again_and_released_again() -> None:
    # Without magnets the chain stays straight, so that it can be drawn in.
    env = UnknownFloorEnv(scene_of(magnets=None), tasks=[TASK], randomisation="none")
    env.reset(seed=0)
    counts, seen, gone, length = [], [], 0.0, 6 * env.scene.casing.diagonal
    for speed in [0.2] * 16 + [-0.2] * 16 + [0.2] * 16:
        observation, *_ = env.step(env.actions.encode(speed))
        gone += INTERVAL * env.history[-1]
        advance = group(env, observation, "advance")[0]
        assert advance == pytest.approx(gone / length, abs=1e-6)
        counts.append(int(env.episodes.arrays.released[0].sum()))
        seen.append(int(group(env, observation, "seen").sum()))
        free = env.episodes.arrays.released[0]
        # Those that left first are free.
        assert free.tolist() == sorted(free.tolist(), reverse=True)
    assert counts[15] == 3
    # One is held again when it is inside with all its length.
    assert counts[31] == 1
    assert counts[-1] == 3
    # A frame late, and never more than are free.
    assert all(shown <= before for before, shown in zip(counts, seen[1:], strict=False))
    assert max(seen) == 3


def test_the_force_is_the_floors_drag_with_noise() -> None:
    friction = 0.5
    scene = scene_of(magnets=None, friction=friction)
    env = UnknownFloorEnv(scene, tasks=[TASK], randomisation="none")
    drag = friction * scene.gravity.normal * scene.masses[0]
    off = []
    for seed in range(12):
        env.reset(seed=seed)
        before = 0
        for _ in range(50):
            observation, *_, info = env.step(env.actions.encode(0.1))
            out = env.episodes.arrays.released[0].sum()
            if len(env.history) > 12 and out == before:
                off.append(info["force"] - out * drag)
            before = out
            shown = group(env, observation, "force")[0]
            force = shown / (1.0 - abs(shown)) * FORCE_SCALE
            assert force == pytest.approx(info["force"], rel=1e-3, abs=1e-6)
    assert len(off) > 300
    assert abs(np.mean(off)) < 4 * 0.01 / np.sqrt(len(off))
    assert np.std(off) == pytest.approx(0.01, rel=0.2)


def test_a_frame_is_one_step_late() -> None:
    env = UnknownFloorEnv(randomisation="none")
    env.reset(seed=0, options={"task": 0})
    n = env.scene.n
    before, ended = np.zeros(n), False
    while not ended:
        observation, _, ended, _, _ = env.step(env.actions.encode(0.1))
        seen = group(env, observation, "seen") > 0.0
        sines, cosines = group(env, observation, "heading").reshape(n, 2).T
        apart = np.arctan2(sines, cosines) - before
        apart = np.abs(np.arctan2(np.sin(apart), np.cos(apart)))[seen]
        assert (apart < np.radians(6.0)).all()
        before = env.state.angles


def test_friction_and_strengths_are_drawn_as_widely_as_said() -> None:
    scene = UnknownFloorEnv().scene
    spreads = scene.spreads
    assert scene.friction == pytest.approx(0.05 * 10**spreads.friction_decades)
    assert scene.friction == pytest.approx(10**-spreads.friction_decades)
    assert (spreads.remanence, spreads.magnet, spreads.feed_speed) == (0.3, 0.15, 0.6)


def test_a_weak_drive_jams() -> None:
    weak = replay(scene_of(feed={"force_limit": 0.02}), [0.1] * 250)
    assert weak.arrays.status[0] == JAMMED
    assert "the drive slipped for 0.1 s" in weak.message(0)
    strong = replay(scene_of(), [0.1] * 250)
    assert strong.arrays.status[0] == FOLDED
    scene = mf.load_scene("unknown-floor").replace(feed={"force_limit": 0.001})
    info = play(UnknownFloorEnv(scene, randomisation="none"), [0.15])[-1][-1]
    assert info["status"] == "jammed"
    assert not info["is_success"]
    assert 0.0 <= info["score"] <= 0.5


def test_shipped_tasks_are_chains_with_two_folds_of_which_difficulty_takes_the_first() -> None:
    tasks = read_tasks("two-folds-6")
    assert len(tasks) == 40
    folds: dict[Any, set[str]] = {}
    for task in tasks:
        folds.setdefault((task.sequence, task.direction), set()).add(task.target)
    assert [len(words) for words in folds.values()] == [2] * 20
    assert {task.direction for task in tasks} == {"forward", "backward"}
    assert UnknownFloorEnv(tasks="two-folds-6", difficulty=0.1).tasks == tasks[:4]


@pytest.mark.parametrize("number", [0, -1])
def test_both_folds_of_a_shipped_task_can_be_had(number: int) -> None:
    tasks = read_tasks("two-folds-6")
    task = tasks[number]
    words = {each.target for each in tasks if each.sequence == task.sequence}
    scene = mf.load_scene("tube-built").replace(
        sequence=task.sequence, feed={"direction": task.direction}
    )
    counts = [count_words(randomised(scene, "nominal"), speed) for speed in CANDIDATE_SPEEDS]
    for word in words:
        assert max(count[word] for count in counts) >= 0.75 * DRAWS


def test_an_episode_counts_the_components_that_act() -> None:
    env = UnknownFloorEnv("tube-feed")
    env.reset(seed=0)
    episodes: Any = env.episodes
    assert env.scene.feed.loading == "at_mouth"
    assert episodes.acting(0) == 0
    env.step(env.actions.encode(0.1))
    assert episodes.acting(0) == 1
    built: Any = UnknownFloorEnv("tube-built")
    built.reset(seed=0)
    assert built.episodes.acting(0) == 6


FILE = """- {sequence: [%s], direction: forward, target: LRLLR}
- {sequence: [%s], direction: backward, target: LRLLR}
""" % ((", ".join(SEQUENCE),) * 2)


@pytest.mark.parametrize("kind", [str, Path])
def test_tasks_may_be_a_file(kind: type, tmp_path: Path) -> None:
    path = tmp_path / "tasks.yaml"
    path.write_text(FILE)
    env = UnknownFloorEnv(tasks=kind(path))
    assert env.tasks == read_tasks([FeedTask(**TASK), TASK | {"direction": "backward"}])
