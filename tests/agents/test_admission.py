"""Tests of the admission rule: its comparisons, its players, and its separate draws."""

import json
from collections.abc import Sequence
from functools import partial
from itertools import chain, pairwise, repeat
from typing import Any, cast

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils import seeding

from agents.admission import players, rule, script
from agents.admission.players import (
    BLIND,
    EVALUATION,
    FORWARD,
    OPEN_LOOP,
    ORACLE,
    RANDOM,
    SCRIPT,
    SEARCH,
    TRAINED,
    AdmissionTrack,
    copies,
    own_track,
)
from agents.open_loops import orders
from agents.open_loops.orders import Orders
from agents.open_loops.schedules import Schedule, constant
from agents.open_loops.search import RolloutPool, Search, halving, rounds
from agents.training import drawing_back, mending, open_loops
from agents.training.drawing_back import Redoing, Refolding
from agents.training.policy_files import SavedPolicy
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.baselines.legs import Leg
from magfold_env.envs.camera_track import INTERVAL
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.chains.dynamic import REFERENCE_SPEED
from magfold_env.envs.reprogram import ReprogramEnv
from magfold_env.envs.spaces.actions import DEAD_BAND, FACES, FASTEST
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.minimiser import minimise
from magfold_env.scoring.policy_file import ObservationForm
from magfold_env.scoring.track import FEED_TRACKS, TRACKS, TRAYS, choice_of_tasks
from tests.agents.training import call
from tests.killed import run_until_killed

FLOOR = "MagFold/UnknownFloor-v0"


@pytest.mark.parametrize(("candidates", "budget"), [(1000, 6000), (64, 250), (13, 28), (2, 2)])
def test_halving_keeps_to_its_budget_and_ends_with_two(candidates: int, budget: int) -> None:
    found = rounds(candidates, budget)
    assert 0.9 * budget <= sum(field * draws for field, draws in found) <= budget
    fields = [field for field, _ in found]
    assert fields[0] == candidates
    assert fields[-1] == 2
    assert all(2 * after - before in (0, 1) for before, after in pairwise(fields))
    with pytest.raises(ValueError, match=r"budget: .* is not allowed"):
        rounds(candidates, sum(fields) - 1)


@pytest.mark.parametrize("best", [0, 17, 99])
def test_halving_finds_the_best_of_known_bandits(best: int) -> None:
    rng = np.random.default_rng(best)
    chances = rng.uniform(0.0, 0.6, 100)
    chances[best] = 0.95
    drawn = rng.random((100, 600)) < chances[:, None]
    played = np.zeros(100, dtype=int)

    def trial(candidates: Ints, start: int, stop: int) -> Floats:
        # Draw after draw, and none twice.
        assert set(played[candidates]) == {start}
        played[candidates] = stop
        success = drawn[candidates, start:stop].astype(float)
        return np.stack([success, 0.5 + 0.5 * success], axis=-1)

    ranked = halving(100, 600, trial)
    winner = ranked[0]
    assert sorted(each.place for each in ranked) == list(range(100))
    draws = [each.draws for each in ranked]
    assert draws == sorted(draws, reverse=True)
    assert winner.place == best
    assert winner.draws == played[best] == played.max()
    assert winner.successes == drawn[best, : winner.draws].sum()


def test_of_as_many_successes_the_higher_score_wins_then_the_first() -> None:
    scores = np.array([0.1, 0.4, 0.4, 0.2])

    def trial(candidates: Ints, start: int, stop: int) -> Floats:
        ends = np.zeros((len(candidates), stop - start, 2))
        ends[..., 1] = scores[candidates, None]
        return ends

    assert [each.place for each in halving(4, 12, trial)] == [1, 2, 3, 0]


@pytest.mark.medium
@pytest.mark.parametrize("env_id", FEED_TRACKS)
def test_schedules_are_ones_that_actions_can_ask_for(env_id: str) -> None:
    track = own_track(env_id, 2)
    found = track.open_loops.candidates(60, 5)
    assert found[:30] == track.open_loops.candidates(30, 5)
    assert found[13:] != track.open_loops.candidates(60, 6)[13:]
    scene, refolds = track.setup.scene, env_id == "MagFold/Reprogram-v0"
    length, diagonal = scene.n * scene.casing.diagonal, scene.casing.diagonal
    families = {"two speeds", "three speeds", "pulses", "push-pull-push"}
    drawn = {each.family for each in found} - {"baseline"}
    assert drawn == ({f"refold, {each}" for each in families} if refolds else families)
    assert refolds or constant(FASTEST) in found
    for schedule in found:
        speeds = np.array([leg.speed for leg in schedule.way])
        size = np.abs(speeds)
        assert np.all((size == 0.0) | ((size >= DEAD_BAND) & (size <= FASTEST)))
        assert speeds[-1] > 0.0
        assert schedule.way[-1].until == np.inf
        assert schedule.time(length) <= 0.8 * INTERVAL * track.episodes(1).horizon
        places = [leg.until for leg in schedule.way if leg.speed and leg.until < np.inf]
        assert all(0.0 < each < length for each in places)
        turns_back = [leg for leg in schedule.way if leg.speed < 0.0]
        if refolds:
            assert turns_back[0].until <= diagonal
            assert length - diagonal < max(places) < length
        else:
            assert bool(turns_back) == (schedule.family == "push-pull-push")


def test_schedules_turn_where_the_feed_has_gone_so_far_and_stand_so_long() -> None:
    track = AdmissionTrack("MagFold/Reprogram-v0", 1, randomised=False)
    episodes, row = track.episodes(1), np.array([0])
    legs = Leg(0.2, 0.041), Leg(0.0, steps=4), Leg(-0.1, 0.031), Leg(0.3)
    following = track.open_loops.following
    episodes.play([0], [0], partial(following([Schedule("drawn", legs)]), episodes))
    driven = episodes.driven[0, : int(episodes.steps[0])]
    gone = INTERVAL * driven.cumsum()
    turns = np.flatnonzero(np.diff(np.sign(driven)))
    assert np.sign(driven[[0, *(turns + 1)]]).tolist() == [1.0, 0.0, -1.0, 1.0]
    assert 0.041 < gone[turns[0]] < 0.041 + 0.2 * INTERVAL
    assert turns[1] - turns[0] == 4
    assert 0.031 - 0.1 * INTERVAL < gone[turns[2]] < 0.031
    # Braked, it stands still near the place that is meant: unbraked it went half a diagonal a step.
    braked = Leg(0.45, 0.06, brakes=True), Leg(0.0)
    plan: Any = following([Schedule("drawn", braked)])
    episodes.rngs = [seeding.np_random(0)[0]]
    episodes.begin(row, [0])
    for _ in range(60):
        episodes.step(row, plan(episodes, row))
    left = 0.06 - float(episodes.chains.advances()[0])
    assert abs(left) < 0.2 * track.setup.scene.casing.diagonal
    assert plan.at[0] == 1


@pytest.mark.slow
@pytest.mark.parametrize("env_id", TRAYS)
def test_orders_are_ones_that_can_be_had_from_the_tray(env_id: str) -> None:
    track, number = own_track(env_id, 2), 13
    task, loops, speeds = track.env.tasks[number], track.open_loops, track.setup.actions.speeds
    found = loops.candidates(60, number)
    assert found[:30] == loops.candidates(30, number)
    assert [each.speeds[0] for each in found[1:5]] == sorted(each.speeds[0] for each in found[1:5])
    assert {each.speeds[0] for each in found[:5]} == set(speeds.tolist())
    assert {len(set(each.speeds)) for each in found[:5]} == {1}
    assert {each.family for each in found[5:]} == {"one speed", "a speed each"}
    seen: set[Any] = set()
    words: set[str] = set()
    for each in found:
        laid = task.as_fed(each.fed)
        assert len({part for part, _ in laid}) == track.setup.scene.n
        assert set(each.speeds) <= set(speeds.tolist())
        faces = ["".join(task.tray[part][k] for k in FACES[lie]) for part, lie in laid]
        seen.add((*faces, each.speeds))
        states = minimise(track.setup.scene.replace(sequence=faces), mode="free", top=2).states
        assert states[1].energy > states[0].energy
        words.add(states[0].word)
    assert len(seen) == len(found)
    anchor = env_id == "MagFold/Anchor-v0"
    assert words > {task.target} if anchor else words == {task.target}
    assert all("S" not in word for word in words)


@pytest.mark.slow
@pytest.mark.parametrize("env_id", TRAYS)
def test_the_oracle_takes_orders_by_their_gaps_with_the_strengths_of_an_episode(
    env_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(orders, "KNOWN", 200)
    track, loops = AdmissionTrack(env_id, 24), Orders(cast("Any", own_track(env_id, 24).env))
    number = int(track.draws(3, 4)[0][0])
    task: Any = track.drawn(3)[1]
    assert len({strength for part in task.strengths for strength in part}) > 20
    best = loops.candidates(13, number)
    found = loops.raced(best, number, task)
    assert found[:7] == best[:7]
    assert [each.speeds for each in found[7:]] == [each.speeds for each in best[:6]]
    gaps = loops.gaps(np.array([each.fed for each in found]), number, task)
    assert (np.diff(gaps[7:]) <= 0.0).all()
    assert gaps[7] > gaps[:7].max()
    # Magnets that are dead or sound are what the minimiser knows of.
    rng = np.random.default_rng(5)
    sound = (rng.random((len(task.tray), 4)) > 0.1).astype(float)
    dead = task.model_copy(update={"strengths": sound})
    told = loops.gaps(np.array([each.fed for each in found]), number, dead)
    for each, gap in zip(found[:7], told[:7], strict=True):
        laid = task.as_fed(each.fed)
        faces = [
            "".join(task.tray[part][k] if sound[part, k] else "-" for k in FACES[lie])
            for part, lie in laid
        ]
        states = minimise(track.setup.scene.replace(sequence=faces), mode="free", top=300).states
        wanted = [state for state in states if state.word == task.target]
        if env_id == "MagFold/Anchor-v0":
            wanted = [state for state in states if "S" not in state.word]
        others = [state for state in states if state.word != wanted[0].word]
        assert gap == pytest.approx(others[0].energy - wanted[0].energy, abs=1e-9)


@pytest.mark.parametrize("env_id", TRACKS)
def test_copies_have_the_physics_of_their_episode_and_other_starts(env_id: str) -> None:
    track = AdmissionTrack(env_id, 3)
    for episode in (0, 4):
        (scene, task), again = track.drawn(episode), players.copied_episodes(track, episode, 2)
        seeds = episode_seeds(copies(episode), 2)
        again.rngs = [seeding.np_random(seed)[0] for seed in seeds]
        again.begin(again.rows)
        drawn = [scene, *map(again.scene, (0, 1))]
        assert len({each.start_offsets for each in drawn}) == 3
        # A scene tells what its own drive makes of speeds, and a copy's is of one that is not off.
        # The sequence is the task's, or chosen.
        kept = {"start_offsets": scene.start_offsets, "sequence": scene.sequence}
        same = {**kept, "feed": {"speed": scene.feed.speed}}
        assert [each.replace(**same) for each in drawn] == [scene] * 3
        np.testing.assert_array_equal(again.chains.factors[0] * REFERENCE_SPEED, scene.speeds)
        if env_id in TRAYS:
            track.drawn(episode)
            env: Any = track.env
            for row in (0, 1):
                np.testing.assert_array_equal(again.strengths[row], env.episodes.strengths[0])
        assert again.setup.tasks == (task,)
    assert track.drawn(0)[0].friction != track.drawn(4)[0].friction


def replaying(chosen: Sequence[Sequence[Any]]) -> Plan:
    """Return a plan that plays each row's choices one after another, and repeats the last one."""
    taken = np.zeros(len(chosen), dtype=np.int64)

    def plan(_: Any, rows: Ints) -> Any:
        now = [chosen[row][min(int(taken[row]), len(chosen[row]) - 1)] for row in rows.tolist()]
        taken[rows] += 1
        return tuple(np.array(part) for part in zip(*now, strict=True))

    return plan


@pytest.mark.parametrize("env_id", TRACKS)
def test_the_field_plays_what_a_single_environment_plays(env_id: str) -> None:
    track = AdmissionTrack(env_id, 2)
    numbers, seeds = track.draws(0, 3)
    rng, env, table = np.random.default_rng(3), track.env, track.setup.actions
    if env_id in TRAYS:
        env.action_space.seed(3)
        actions = [[env.action_space.sample() for _ in range(9)] for _ in numbers]
    else:
        tried = rng.uniform(0.1, 0.6, (3, 1)) * np.sign(rng.uniform(-0.2, 1.0, (3, 90)))
        actions = [[table.encode(speed) for speed in each] for each in tried]
    chosen = [[[part[0] for part in table.read_one(each)] for each in one] for one in actions]
    ends = track.pool.play(numbers, seeds, lambda part: replaying(chosen[part]))
    for number, seed, asked, end in zip(numbers, seeds, actions, ends, strict=True):
        env.reset(seed=seed, options={"task": int(number)})
        info: dict[str, Any] = {}
        for action in chain(asked, repeat(asked[-1])):
            *_, terminated, _, info = env.step(action)
            if terminated:
                break
        assert (info["is_success"], info["score"]) == tuple(end)


def test_draws_of_results_are_used_for_nothing_else() -> None:
    others = ["evaluation", "validation", "selection", "scoring", "search 0", SEARCH]
    others += [mending.STREAM, drawing_back.STREAM, open_loops.STREAM]
    streams = [*others, *map(copies, range(1000))]
    seeds = {seed for stream in streams for seed in episode_seeds(stream, 30)}
    assert len(seeds) == 30 * len(streams)
    reported = episode_seeds(EVALUATION, 1000)
    assert len(set(reported)) == 1000
    assert seeds.isdisjoint(reported)
    assert min(reported) > 2**64  # training seeds are below 2³²


def test_tasks_are_spread_over_the_list() -> None:
    assert choice_of_tasks(40, 24)[:4] == [0, 1, 3, 5]
    assert len(set(choice_of_tasks(40, 24))) == 24
    assert choice_of_tasks(3, 24) == [0, 1, 2]


def ends_of(rates: dict[str, float], runs: int = 1) -> dict[str, Any]:
    """Return the results of 1000 episodes per player, which succeed at the given rates."""
    found: dict[str, Any] = {}
    for name, rate in rates.items():
        success = np.tile((np.arange(1000) % 100 < 100 * rate).astype(float), (runs, 1))
        found[name] = np.stack([success, 0.5 + 0.5 * success], axis=-1)
    return found


HELD = {
    RANDOM: 0.1,
    FORWARD: 0.4,
    SCRIPT: 0.6,
    OPEN_LOOP: 0.7,
    ORACLE: 0.9,
    TRAINED: 0.8,
    BLIND: 0.5,
}


@pytest.mark.parametrize(("changes", "holds", "said"), [
    ({}, [True] * 4, "tasks admitted, policy counts"),
    ({ORACLE: 0.79}, [False, True, True, True], "tasks not admitted, policy counts"),
    ({SCRIPT: 0.76}, [True, False, True, True], "tasks admitted, policy does not count"),
    ({BLIND: 0.76}, [True, True, False, True], "tasks admitted, policy does not count"),
    ({FORWARD: 0.51}, [True, True, True, False], "tasks admitted, policy does not count"),
])  # fmt: skip
def test_each_line_of_the_rule_decides(changes, holds, said):
    verdict = rule.judge(ends_of(HELD | changes, runs=2))
    assert [line.holds for line in (verdict.tasks, *verdict.policy)] == holds
    assert verdict.decision == said
    assert [verdict.rows[name].figures["normalised"] for name in (RANDOM, ORACLE)] == [0.0, 1.0]
    assert verdict.differences["trained − open loop"] is not None


def test_a_lead_that_may_be_chance_is_none() -> None:
    ten = {name: each[:, 5:100:10] for name, each in ends_of(HELD).items()}
    lead = rule.judge(ten).policy[0]
    assert lead.measured is not None
    assert lead.measured.value == pytest.approx(0.2)
    assert lead.holds is False


def test_what_was_not_given_is_not_measured() -> None:
    rates = {name: HELD[name] for name in (RANDOM, FORWARD, SCRIPT, OPEN_LOOP, ORACLE)}
    verdict = rule.judge(ends_of(rates))
    assert [line.holds for line in verdict.policy] == [None] * 3
    assert verdict.decision == "tasks admitted, policy not measured"
    assert rule.markdown(verdict).count("not measured |") == 3


def test_episodes_of_one_chain_count_together() -> None:
    chains = [0, 0, 1, 2, 2]  # two tasks each of the first and the last chain
    success = np.array([1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0])
    ends = np.stack([success, 2.0 * success], axis=-1)[None]
    found = rule.by_chain(ends, chains)
    np.testing.assert_allclose(found[..., 0], [[0.5, 0.5, 1.0]])
    np.testing.assert_allclose(found[..., 1], 2.0 * found[..., 0])
    track = own_track("MagFold/UnknownFloor-v1", None)
    sequences = [track.env.tasks[number].sequence for number in track.numbers]
    assert len(set(sequences)) == len(set(track.chains)) == 200
    assert len({*zip(sequences, track.chains, strict=True)}) == 200


def test_the_script_is_tuned_on_training_tasks_only(monkeypatch: pytest.MonkeyPatch) -> None:
    played: set[Any] = set()
    own_play = RolloutPool.play

    def play(pool: RolloutPool, numbers: Ints, *given: Any) -> Any:
        played.update(pool.episodes.setup.tasks[number] for number in numbers.tolist())
        return own_play(pool, numbers, *given)

    monkeypatch.setattr(RolloutPool, "play", play)
    track = own_track("MagFold/UnknownFloor-v1", None)
    (place,) = players.tune_script(track, Search(4, 40), 0, 1)
    assert place in range(4)
    assert len(played) > 10
    assert played.isdisjoint(track.env.tasks)


def test_the_script_has_settings_for_every_environment_with_given_chains() -> None:
    for env_id in FEED_TRACKS:
        env: Any = own_track(env_id, 1).env
        found = script.candidates(env, 20)
        assert len(set(found)) >= 19
        kind = Refolding if isinstance(env, ReprogramEnv) else Redoing
        assert {type(each) for each in found} == {kind}


class Stacked:
    """A policy that feeds more slowly the more components its stacked frames show."""

    action_space: Any = spaces.Box(-1.0, 1.0, (1,), np.float32)

    def __init__(self, frames: int, width: int = 74) -> None:
        shape = (width,) if frames == 1 else (frames, width)
        self.observation_space = spaces.Box(-1.0, 1.0, shape, np.float32)
        self.shown: list[Any] = []

    def predict(self, observation: Any, state: Any, episode_start: Any, deterministic: bool) -> Any:
        assert deterministic
        assert episode_start.all() == (state is None)
        self.shown.append(observation)
        frames = observation.reshape(len(observation), -1, 74)
        # `seen`, after target, magnets and direction.
        out = frames[:, :, 40:46].sum(axis=(1, 2))
        share = np.clip(0.8 - 0.02 * out, 0.3, 1.0)
        return share[:, None].astype(np.float32), len(self.shown)


def saved(policy: Any, frames: int = 1, blind: bool = False) -> SavedPolicy:
    return SavedPolicy(policy, ObservationForm(frames=frames, blind=blind), steps=0)


def test_policies_see_their_frames_and_the_blind_do_not() -> None:
    track = AdmissionTrack(FLOOR, 1)
    policy = Stacked(3)
    players.play_policy(track, saved(policy, 3), TRAINED, 0, 2)
    shown = np.array(policy.shown)
    assert shown.shape[1:] == (2, 3, 74)
    np.testing.assert_array_equal(shown[0, :, 0], shown[0, :, 2])
    np.testing.assert_array_equal(shown[1:, :, :2], shown[:-1, :, 1:])
    assert shown[-1, :, :, 40:46].any()

    for stated, by_file in ((BLIND, False), (TRAINED, True)):
        policy = Stacked(3)
        players.play_policy(track, saved(policy, 3, by_file), stated, 0, 2)
        assert not np.array(policy.shown)[..., 40:70].any()

    for wrong in (saved(Stacked(1, 75)), saved(Stacked(3), 4)):
        with pytest.raises(ValueError, match=r"policy: its spaces .* are not the environment's"):
            players.play_policy(track, wrong, TRAINED, 0, 2)


class Careful:
    """A policy that takes the first allowed component, and goes back once if it is allowed."""

    def __init__(self, env: Any) -> None:
        self.observation_space, self.action_space = env.observation_space, env.action_space
        self.masks: list[Any] = []

    def predict(
        self, observation: Any, state: Any, episode_start: Any, deterministic: bool,
        action_masks: Any = None,
    ) -> Any:  # fmt: skip
        self.masks.append(action_masks)
        parts = action_masks[:, :9].argmax(axis=1)
        ways = 9 + 8 + 5
        step = state or 0
        back = action_masks[:, ways + 1] & (step == 3)
        return np.stack([parts, 0 * parts, 0 * parts + 4, back], axis=1), step + 1


@pytest.mark.parametrize("env_id", TRAYS)
def test_masks_are_those_of_every_episode_at_every_step(env_id: str) -> None:
    track = AdmissionTrack(env_id, 2)
    policy = Careful(track.env)
    played = players.play_policy(track, saved(policy), TRAINED, 0, 2)
    masks = np.array(policy.masks)
    assert masks.shape[1:] == (2, 9 + 8 + 5 + track.setup.actions.ways)
    assert masks[:6, :, :9].sum(axis=2).T.tolist() == [[9, 8, 7, 6, 7, 6]] * 2
    assert masks[:4, :, 23].T.tolist() == [[False, False, True, True]] * 2
    steps = [(0, 0), (1, 0), (2, 0), (0, 1), (2, 0), (3, 0), (4, 0), (5, 0)]
    chosen = [[(part, 0, FASTEST, way) for part, way in steps]] * 2
    again = track.pool.play(*track.draws(0, 2), lambda part: replaying(chosen[part]))
    np.testing.assert_array_equal(again, played)
    discrete = track.env_of(spaces.Discrete(9 * 8 * 3 * track.setup.actions.ways))
    assert len(discrete.actions.speeds) == 3


KILLED = """
import sys
from agents.admission.__main__ import main

main(
    sys.argv[1], tasks=2, episodes=3, search=(13, 32), race=(13, 32), script=(4, 40),
    processes=1,
    output=__import__("pathlib").Path(sys.argv[2]),
)
"""


@pytest.mark.slow
def test_the_command_goes_on_where_it_was_killed(tmp_path, monkeypatch):
    folder = tmp_path / "killed"
    options = [
        "--tasks",
        2,
        "--episodes",
        3,
        "--search",
        13,
        32,
        "--race",
        13,
        32,
        "--script",
        4,
        40,
    ]
    given = ["admission.__main__", FLOOR, "--processes", 1, *options, "--output"]
    run_until_killed(2, KILLED, FLOOR, str(folder))
    searched: list[int] = []

    def search(pool: RolloutPool, number: int, *given: Any) -> Any:
        searched.append(number)
        return own_search(pool, number, *given)

    own_search = RolloutPool.search
    monkeypatch.setattr(RolloutPool, "search", search)
    call(*given, folder, code=0)
    assert not searched  # both tasks were
    content = json.loads((folder / "admission.json").read_text(encoding="utf-8"))
    call(*given, tmp_path / "whole", code=0)
    again = json.loads((tmp_path / "whole" / "admission.json").read_text(encoding="utf-8"))
    for each in (content, again):
        each.pop("provenance")
    assert content == again
    assert set(content["rows"]) == {RANDOM, FORWARD, SCRIPT, OPEN_LOOP, ORACLE}
    for row in content["rows"].values():
        first, second, third = map(int, row["runs"][0]["success"])
        assert row["success"][0] == pytest.approx((0.5 * (first + third) + second) / 2)
    assert content["figures"]["verdict"].endswith("policy not measured")
    assert "Verdict:" in (folder / "admission.md").read_text(encoding="utf-8")
    other = call(*given, folder, "--tasks", 1, code=2)
    assert "was written by another run" in other.output
