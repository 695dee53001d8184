"""Tests of `Anchor`: folds from a tray that bear a pull, after trials and repairs."""

from typing import Any

import numpy as np
import pytest

from magfold_env.envs.anchor import LASTING, OUT, SETTLING, STAGE, STAGES, AnchorEnv
from magfold_env.envs.baselines import baseline, tray_order
from magfold_env.envs.camera_track import FORCE_NOISE, TIME_COST
from magfold_env.envs.spaces.actions import FACES
from magfold_env.envs.tray import LATE
from magfold_env.scoring.observation_view import blind
from tests.envs.contract import group

TASK: dict[str, Any] = {
    "tray": ("SNSN", "NNSS", "NSSN", "NSNN", "SNNS", "NSNS", "SSNN", "SNNS", "SSSN"),
    "direction": "forward", "target": "RLLLR", "strengths": ((1.0,) * 4,) * 9, "pull": 0.5,
    "towards": -0.06,
}  # fmt: skip
CHAIN = [(1, 3), (0, 0), (2, 2), (5, 1), (3, 3), (4, 2)]
"""Components and their orientations, beginning with component 1."""
FAST, SLOW = 0.6, 0.03
ROW = np.array([0])


def made(**changes: Any) -> Any:
    """Return an environment of one task without random draws, after a reset."""
    env = AnchorEnv(tasks=[TASK | changes], randomisation="none")
    env.reset(seed=0)
    return env


def folded(**changes: Any) -> Any:
    """Return an environment whose chain is complete and has folded into the target."""
    env = made(**changes)
    for part, lie in CHAIN if env.task.direction == "forward" else CHAIN[::-1]:
        env.step(env.actions.encode(part, lie, 0.1))
    assert env.episodes.turned(ROW).all()
    return env


def feed(env: Any, speed: float = FAST) -> tuple[Any, ...]:
    """Feed the next component, or leave the chain."""
    return env.step(env.actions.encode(0, 0, speed))


def test_the_tube_keeps_the_last_component_which_can_be_drawn_back_and_fed_again() -> None:
    env = made()
    for _ in range(6):
        feed(env, SLOW)
    chains, arrays = env.episodes.chains, env.episodes.arrays
    pitch = env.scene.casing.diagonal
    outer = chains.engine.q[0, 6]
    assert arrays.fed[0] == 6
    assert arrays.released[0].sum() == 5
    assert outer == pytest.approx(OUT * pitch)
    assert (chains.engine.charge[0] != 0).all()
    began = env.episodes.times(ROW)[0]
    observation, *_ = env.step(env.actions.encode(0, 0, SLOW, back=True))
    assert env.episodes.times(ROW)[0] - began == pytest.approx(OUT * pitch / SLOW)
    assert arrays.fed[0] == arrays.released[0].sum() == 5
    assert (group(env, observation, "place") > 0).sum() == 5
    assert (chains.engine.charge[0] != 0).all(axis=1).sum() == 5
    began = env.episodes.times(ROW)[0]
    feed(env, SLOW)
    assert env.episodes.times(ROW)[0] - began == pytest.approx(OUT * pitch / SLOW + SETTLING)
    assert chains.engine.q[0, 6] == pytest.approx(outer)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_a_fold_bears_what_it_bears_by_test_and_when_it_is_left(direction: str) -> None:
    borne = []
    for pull in (0.02, 3.0):
        env = folded(direction=direction, pull=pull)
        observation, *_ = env.step(env.actions.pull)
        borne.append(env.episodes._force[0])
        shown = group(env, observation, "borne")[0]
        assert shown == pytest.approx(np.clip(borne[-1] / pull, 0.0, 1.0), abs=1e-6)
        again = folded(direction=direction, pull=pull)
        *_, info = feed(again)
        assert (info["status"], info["message"]) == (
            ("held", "left: no folded joint opened")
            if pull < 1.0
            else ("opened", "left: a folded joint opened")
        )
        stages = STAGES if pull < 1.0 else round(STAGES * borne[-1] / pull)
        assert info["score"] == 0.5 + 0.5 * stages / STAGES
        assert info["is_success"] == (pull < 1.0)
    assert borne[0] == pytest.approx(0.02, abs=6.0 * FORCE_NOISE)
    assert borne[1] < 2.9


def test_a_chain_that_has_not_folded_is_worth_half_of_the_joints_that_have() -> None:
    env = made()
    for _ in range(6):
        feed(env)
    turned = env.episodes.turned(ROW).mean()
    assert turned < 1.0
    *_, ended, _, info = feed(env)
    assert ended
    assert (info["score"], info["is_success"]) == (0.5 * turned, False)


def test_a_test_takes_time_and_changes_neither_the_tray_nor_a_fold_that_bears_it() -> None:
    env = folded(pull=0.02)
    before, places = env.state.angles, env.episodes.places.copy()
    observation, reward, ended, _, info = env.step(env.actions.pull)
    took = (STAGES - 1) * STAGE + LASTING
    assert not ended
    assert reward == pytest.approx(-TIME_COST * took)
    assert info["pull"] == 0.02
    assert group(env, observation, "speed") == 0.0
    np.testing.assert_allclose(env.state.angles, before, atol=0.02)
    np.testing.assert_array_equal(env.episodes.places, places)
    observation, *_ = env.step(env.actions.encode(0, 0, FAST, back=True))
    assert group(env, observation, "borne") == 0.0


def test_the_pull_is_shown_but_neither_the_target_nor_to_the_blind_a_test() -> None:
    env = made(pull=0.5, towards=0.5 * np.pi)
    observation, info = env.reset(seed=1)
    np.testing.assert_allclose(group(env, observation, "pull"), [0.0, 0.5], atol=1e-7)
    assert "target" not in env.layout.slices
    assert info["pull"] == 0.5
    env = folded()
    seen = env.step(env.actions.pull)[0]
    assert group(env, seen, "borne") > 0.0
    assert group(env, blind(env.layout, seen), "borne") == 0.0


def test_an_episode_that_is_never_left_is_late() -> None:
    env, ended, info = made(), False, {}
    while not ended:
        *_, ended, _, info = env.step(env.actions.pull)
    assert (info["status"], info["score"], info["is_success"]) == ("unsettled", 0.0, False)
    assert info["message"] == f"late: not left after {LATE:g} s"


def test_pulls_of_one_tray_have_baselines_of_their_own(monkeypatch, tmp_path):
    sequence = tuple("".join(TASK["tray"][part][k] for k in FACES[lie]) for part, lie in CHAIN)
    monkeypatch.setattr(tray_order.TrayDesigns, "__init__", lambda *_: None)
    monkeypatch.setattr(tray_order.TrayDesigns, "best", lambda *_: sequence)
    monkeypatch.setattr(tray_order.TrayStore, "draws", (1, 1))
    monkeypatch.setattr(baseline, "user_cache_path", lambda _name: tmp_path)
    env = AnchorEnv(tasks=[TASK, TASK | {"pull": 0.02}], randomisation="none", speeds=2)
    strong, weak = (env.baseline_of(number) for number in range(2))
    assert strong.name == env.tasks[0].name != weak.name == env.tasks[1].name
    assert strong.sequence == weak.sequence == sequence
    assert strong.score <= weak.score
