"""Tests of `Tray`: components, some with bad magnets, are taken from a tray and put back."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.anchor import AnchorEnv
from magfold_env.envs.baselines.tray_order import TrayDesigns
from magfold_env.envs.camera_track import TIME_COST
from magfold_env.envs.spaces.actions import FACES
from magfold_env.envs.tasks.feed_tasks import TrayTask
from magfold_env.envs.tray import DEAD, LATE, SPREAD, WEAK, WEAKNESS, TrayEnv, TrayVectorEnv
from tests.envs.contract import group

TASK: dict[str, Any] = {
    "tray": ("NSSN", "SNSN", "NNSS", "NSSN", "NSNN", "SNNS", "NSNS", "SSNN", "SNNS"),
    "direction": "forward",
    "target": "RLLRR",
}
SOUND = ((1.0,) * 4,) * 9
FAST = 0.6


def fed(env: TrayEnv, part: int, lie: int = 0, speed: float = FAST) -> tuple[Any, ...]:
    """Feed a component."""
    return env.step(env.actions.encode(part, lie, speed))


def drawn_back(env: TrayEnv, speed: float = FAST) -> tuple[Any, ...]:
    """Draw a component back."""
    return env.step(env.actions.encode(0, 0, speed, back=True))


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_without_drawing_back_it_is_a_chain_that_was_ordered(direction: str) -> None:
    env: Any = TrayEnv(tasks=[TASK | {"direction": direction}], randomisation="nominal")
    env.reset(seed=2)
    env.episodes.strengths[:] = 1.0
    said = [fed(env, part, lie=part, speed=0.1) for part in range(6)]
    letters = [TASK["tray"][part] for part in range(6)]
    sequence = ["".join(faces[k] for k in FACES[lie]) for lie, faces in enumerate(letters)]
    scene = env.episodes.scene(0)
    assert scene.sequence == tuple(sequence if direction == "forward" else sequence[::-1])
    fold = mf.simulate(scene)
    np.testing.assert_array_equal(fold.angles, env.state.angles)
    assert said[-1][-1]["status"] == str(fold.status)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_what_is_drawn_back_is_on_the_tray_and_chosen_anew(direction: str) -> None:
    env: Any = TrayEnv(tasks=[TASK | {"direction": direction}])
    env.reset(seed=0)
    fed(env, 4)
    fed(env, 2, lie=5)
    seen = fed(env, 7)[0]
    place = np.zeros(9)
    place[[4, 2, 7]] = np.array([1, 2, 3]) / 6
    np.testing.assert_allclose(group(env, seen, "place"), place, rtol=1e-6)
    seen = drawn_back(env)[0]
    place[7] = 0.0
    np.testing.assert_allclose(group(env, seen, "place"), place, rtol=1e-6)
    returned = group(env, seen, "returned")
    assert np.flatnonzero(returned).tolist() == [7]
    assert np.count_nonzero(group(env, seen, "magnets")) == 8
    assert group(env, seen, "seen").sum() <= 2
    assert group(env, seen, "speed") == -1.0
    seen = fed(env, 0, lie=1)[0]
    place[0] = 0.5
    np.testing.assert_allclose(group(env, seen, "place"), place, rtol=1e-6)
    index = 2 if direction == "forward" else 3
    chosen = group(env, seen, "magnets").reshape(6, 4)[index]
    letters = ["NSSN"[k] for k in FACES[1]]
    assert chosen.tolist() == [1.0 if letter == "N" else -1.0 for letter in letters]


def test_drawn_in_a_component_has_no_magnets_and_the_next_one_its_own() -> None:
    envs: Any = TrayVectorEnv(16, threads=1, autoreset_mode="Disabled", shaping="energy")
    envs.reset(seed=4)
    envs.action_space.seed(4)
    backs = 0
    for _ in range(12):
        over = envs.episodes.terminated.copy()
        if over.any():
            envs.reset(options={"reset_mask": over})
        before = envs.episodes.arrays.fed.copy()
        actions = envs.action_space.sample()
        envs.step(actions)
        all_of = envs.episodes
        going = ~all_of.terminated
        out = all_of.arrays.fed
        drawn = (actions[:, 3] == 1) & (before > 1) & going
        np.testing.assert_array_equal(out[drawn], before[drawn] - 1)
        np.testing.assert_array_equal(out[~drawn & going], before[~drawn & going] + 1)
        backs += int(drawn.sum())
        np.testing.assert_array_equal((all_of.places > 0).sum(axis=1), out)
        np.testing.assert_array_equal((all_of.arrays.signs != 0).all(axis=2).sum(axis=1), out)
        acting = (all_of.chains.engine.charge != 0).any(axis=2).sum(axis=1)
        assert (acting[going] <= out[going]).all()
    assert backs > 20


def test_the_first_component_is_not_drawn_back_and_used_ones_stand_for_others() -> None:
    env: Any = TrayEnv(tasks=[TASK])
    env.reset(seed=0)
    assert not env.action_masks()[-1]
    drawn_back(env)
    assert env.episodes.places[0].tolist() == [1, 0, 0, 0, 0, 0, 0, 0, 0]
    drawn_back(env)
    fed(env, 0)
    assert env.episodes.places[0].tolist() == [1, 2, 3, 0, 0, 0, 0, 0, 0]
    fed(env, 8)
    fed(env, 8)
    assert env.episodes.places[0].tolist() == [1, 2, 3, 5, 0, 0, 0, 0, 4]
    mask = env.action_masks()
    np.testing.assert_array_equal(mask[:9], env.episodes.places[0] == 0)
    assert mask[-1]
    assert env.episodes.action_masks(env.actions).tolist() == [mask.tolist()]


def test_the_time_is_simulated_costs_and_ends_the_episode() -> None:
    env: Any = TrayEnv(tasks=[TASK], speeds=2)
    env.reset(seed=0)
    fed(env, 0)
    total, ended, info = 0.0, False, {}
    while not ended:
        before = env.episodes.times(np.array([0]))[0]
        back = env.action_masks()[-1]
        _, reward, ended, _, info = drawn_back(env, 0.03) if back else fed(env, 1, speed=0.03)
        assert reward == pytest.approx(-TIME_COST * (info["time"] - before))
        total += reward
    assert (info["status"], info["score"], info["is_success"]) == ("unsettled", 0.0, False)
    assert info["message"] == "late: not at rest and all out after 10 s"
    assert info["time"] == pytest.approx(LATE)
    assert total > -TIME_COST * LATE


def test_strengths_are_drawn_alike_whatever_the_task_and_never_shown() -> None:
    env: Any = TrayEnv()
    seen, found = [], []
    for number in range(2):
        observation, _ = env.reset(seed=5, options={"task": number})
        found.append(env.episodes.strengths[0].copy())
        seen.append(observation)
    np.testing.assert_array_equal(found[0], found[1])
    given: Any = TrayEnv(
        tasks=[TASK | {"strengths": found[0].tolist()}, TASK | {"strengths": SOUND}]
    )
    told = [given.reset(seed=5, options={"task": number})[0] for number in range(2)]
    np.testing.assert_array_equal(told[0], told[1])
    np.testing.assert_array_equal(given.episodes.strengths[0], 1.0)
    given.reset(seed=9, options={"task": 0})
    np.testing.assert_array_equal(given.episodes.strengths[0], found[0])
    still: Any = TrayEnv(randomisation="none")
    still.reset(seed=5)
    np.testing.assert_array_equal(still.episodes.strengths, 1.0)


def test_as_many_magnets_are_dead_and_weak_as_is_said() -> None:
    envs: Any = TrayVectorEnv(100, threads=1)
    envs.reset(seed=0)
    found = envs.episodes.strengths
    draws = found.size
    for low, high, share in (
        (0.0, 0.0, DEAD),
        (WEAKNESS * (1.0 - SPREAD), WEAKNESS * (1.0 + SPREAD), WEAK),
        (1.0 - SPREAD, 1.0 + SPREAD, 1.0 - DEAD - WEAK),
    ):
        counted = ((found >= low) & (found <= high)).sum()
        assert abs(counted - share * draws) < 5.0 * np.sqrt(share * (1.0 - share) * draws)


def test_a_dead_magnet_does_not_act_where_it_lies() -> None:
    dead = [[1.0] * 4 for _ in range(9)]
    dead[2][1] = 0.0
    env: Any = TrayEnv(tasks=[TASK | {"strengths": dead}])
    env.reset(seed=0)
    fed(env, 0)
    fed(env, 2, lie=6)
    charges = env.episodes.chains.engine.charge[0]
    assert (charges == 0).sum() == 4 * 4 + 1
    drawn_back(env)
    assert (env.episodes.chains.engine.waiting[0] == 0).all(axis=1).sum() == 5
    fed(env, 3)
    assert (env.episodes.chains.engine.charge[0] == 0).sum() == 4 * 4


@pytest.mark.medium
def test_the_minimisers_chain_has_the_largest_gap_of_those_that_can_be_had() -> None:
    scene, tray = mf.load_scene("tray"), ("NSSN", "SNSN", "NNSN", "NSNN", "SNNS", "NSNS", "SSNN")
    designs = TrayDesigns(scene, "LRLRL")
    best: Any = designs.best(tray)
    task = TrayTask(tray=tray, direction="forward", target="LRLRL")
    order: Any = task.order_of(best)
    assert len({part for part, _ in order}) == 6
    for faces, (part, lie) in zip(best, order, strict=True):
        assert faces == "".join(tray[part][k] for k in FACES[lie])
    states = mf.minimise(scene.replace(sequence=best), mode="free", top=2).states
    assert states[0].word == "LRLRL"
    better = designs.gaps > 1.001 * (states[1].energy - states[0].energy)
    assert not designs._fit(tray)[:, better].any()
    assert designs.best(("NNNN",) * 9) is None


@pytest.mark.parametrize("make", [TrayEnv, AnchorEnv])
def test_shipped_trays_have_three_components_to_spare(make: type[TrayEnv]) -> None:
    tasks = make().tasks
    assert len(tasks) <= 24
    assert {task.direction for task in tasks} == {"forward", "backward"}
    assert {len(task.tray) - task.n for task in tasks} == {3}
