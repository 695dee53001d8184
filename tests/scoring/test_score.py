"""Tests of submissions, which play the unchanged environment, and of the files of their results."""

import json
import math
import re
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player
from magfold_env.scoring.results import Results, Row, Run, summed
from magfold_env.scoring.score import score, track_of
from magfold_env.scoring.track import TRACKS, TRAYS
from tests.scoring.test_network import untrained

FLOOR = "MagFold/UnknownFloor-v0"


def entered(path: Path, env_id: str, **changes: Any) -> Path:
    """Write an untrained policy for a track."""
    env: Any = gymnasium.make(env_id)
    box, actions = env.observation_space, {"low": [-1.0], "high": [1.0]}
    if isinstance(env.action_space, spaces.MultiDiscrete):
        actions = {"nvec": env.action_space.nvec.tolist()}
    seen = {"low": box.low.tolist(), "high": box.high.tolist()}
    untrained(path, observations=seen, **{"actions": actions} | changes)
    return path


@pytest.mark.parametrize("env_id", TRACKS)
@pytest.mark.parametrize("kind", ["discrete", "multidiscrete"])
@pytest.mark.parametrize("speeds", [2, 3, 5])
def test_a_policy_plays_the_environment_of_its_actions(env_id: str, kind: str, speeds: int) -> None:
    actions = gymnasium.make(env_id, actions=kind, speeds=speeds).action_space
    assert track_of(env_id, 0).env_of(actions).action_space == actions


def played_alone(path: Path, env_id: str, seed: int, count: int) -> tuple[list[Any], list[Any]]:
    """Return the results of episodes of a single environment, and their actions."""
    actor, track = Actor.read(path), track_of(env_id, seed)
    env = track.env_of(actor.action_space)
    ends: list[Any] = []
    actions: list[Any] = []
    for number, draw in zip(*track.draws(0, count), strict=True):
        observation, _ = env.reset(seed=draw, options={"task": int(number)})
        player, over = Player(actor, actor.settings, env), False
        info: dict[str, Any] = {}
        actions.append([])
        while not over:
            action = player.act(observation[None])[0]
            digits, sizes = np.ravel(action), getattr(env.action_space, "nvec", None)
            single = digits[0] if sizes is None else np.ravel_multi_index(digits, sizes)
            actions[-1].append(single.item())
            observation, _, over, _, info = env.step(action)
        ends.append((int(number), info["is_success"], info["score"], info["energy"]))
    return ends, actions


def ended(found: Results, kind: str) -> list[Any]:
    """Return the results of the episodes of a score."""
    ((name, row),) = found.rows.items()
    assert (name, row.kind) == ("mine", kind)
    (run,) = row.runs
    return list(zip(run.task, map(bool, map(int, run.success)), run.score, run.energy, strict=True))


@pytest.mark.parametrize("env_id", TRACKS)
def test_a_policy_plays_as_it_does_alone(env_id: str, tmp_path: Path) -> None:
    # Of a few speeds it chooses the same whichever way numbers are rounded.
    changes = {} if env_id in TRAYS else {"actions": {"n": 11}}
    policy = entered(tmp_path / "mine.safetensors", env_id, frames=2, **changes)
    found = score(policy, env_id, seed=5, episodes=2)
    assert ended(found, "policy") == played_alone(policy, env_id, 5, 2)[0]
    assert (found.seed, found.id) == (5, env_id)


@pytest.mark.parametrize("env_id", TRACKS)
def test_actions_replay_bit_for_bit(env_id: str, tmp_path: Path) -> None:
    policy = entered(tmp_path / "mine.safetensors", env_id)
    ends, actions = played_alone(policy, env_id, 5, 2)
    content = {"format": "magfold_env actions 1", "id": env_id, "seed": 5, "actions": actions}
    (tmp_path / "mine.json").write_text(json.dumps(content), encoding="utf-8")
    found = score(tmp_path / "mine.json")
    assert ended(found, "actions") == ends
    assert (found.seed, found.id) == (5, env_id)


@pytest.mark.parametrize(
    "wrong", [{"minutes": math.nan}, {"minutes": 0.0}, {"episodes": 0}, {"seed": -1}, {"seed": 0.5}]
)
def test_wrong_arguments_are_named(wrong: dict[str, Any], tmp_path: Path) -> None:
    policy = entered(tmp_path / "mine.safetensors", FLOOR)
    (((key, value),)) = wrong.items()
    with pytest.raises(ValueError, match=rf"^{key}: {value} is not allowed; must be "):
        score(policy, FLOOR, **({"episodes": 1, **wrong}))


def test_seeds_draw_apart() -> None:
    one, other = (track_of(FLOOR, seed).draws(0, 1000)[1] for seed in (1, 2))
    assert len({*one, *other}) == 2000
    assert one == episode_seeds("score 1", 1000)
    assert track_of(FLOOR, 1).draws(7, 9)[1] == one[7:9]


def changed(**changes: Any) -> dict[str, Any]:
    whole = {"format": "magfold_env actions 1", "id": FLOOR, "seed": 0, "actions": [[0.5]]}
    return whole | changes


@pytest.mark.parametrize(("content", "message"), [
    (changed(format="actions"), "is not a file of actions; format: 'actions' is not allowed"),
    (changed(id="MagFold/TubeFeed-v0"),
     "id: 'MagFold/TubeFeed-v0' is not allowed; must be one"),
    (changed(seed=-1), "seed: -1 is not allowed; must be greater than or equal to 0"),
    (changed(seed=1.5), "seed: 1.5 is not allowed; must be a valid integer"),
    (changed(actions=[]), "actions: [] is not allowed; must have at least 1 item"),
    (changed(actions=[[0.1], [0.2, 1.01]]), "actions[1][1]: 1.01 is not allowed; must be a n"),
    (changed(id="MagFold/Tray-v0", actions=[[0.0, 0.5]]),
     "actions[0][1]: 0.5 is not allowed; must be a whole number from 0 to 719"),
    (changed(actions=[[0.1, "a"]]), "actions[0][1]: 'a' is not allowed; must be a number"),
    (changed(actions=[[1e999]]), "actions[0][0]: inf is not allowed; must be"),
    (changed(episodes=3), "episodes: 3 is not allowed; unknown key, must be one of format"),
    (changed(self=3), "self: 3 is not allowed; unknown key"),
    (changed(actions=[[0.5] * 9]), "actions[0]: 9 actions are not allowed; must be more"),
    ([], "is not a file of actions"),
])  # fmt: skip
def test_what_is_wrong_with_actions_is_named(content: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(f"mine.json: {message}")):
        score(path)


RUN = Run(task=(0, 3), success="10", score=(1.0, 0.25), energy=(None, -0.5))


def scored(**changes: Any) -> Results:
    """Return a score of two episodes."""
    files = {"name": "mine.safetensors", "sha256": "0" * 64}
    row = Row(**{**summed(RUN), "kind": "policy", "files": (files,), "runs": (RUN,), **changes})
    rows = {"mine": row}
    return Results(
        view="score", id=FLOOR, draws=2, seed=0, physics="0" * 16, provenance={}, rows=rows
    )


def test_a_score_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "score.json"
    made = scored()
    made.write(path)
    assert Results.read(path, "score") == made
    with pytest.raises(
        ValueError, match=r"score\.json: view: 'score' is not allowed; must be ablation"
    ):
        Results.read(path, "ablation")


@pytest.mark.parametrize(("change", "message"), [
    (lambda run: run["score"].__setitem__(1, "high"), "rows.mine.runs[0].score[1]: 'high'"),
    (lambda run: run["score"].append(0.5), "rows.mine.runs[0].score: 3 is not allowed; must h"),
    (lambda run: run.update(success="1x"), "rows.mine.runs[0].success: '1x' is not allowed"),
    (lambda run: run.update(success="11"), "rows.mine.success: (0.5, "),
    (lambda run: run["score"].__setitem__(1, 0.5), "rows.mine.score: 0.625 is not allowed"),
    (lambda run: run.pop("task"), "rows.mine.runs: 1 is not allowed; must be one, with task"),
])  # fmt: skip
def test_a_score_that_is_not_that_of_its_episodes_is_refused(change, message, tmp_path):
    path = tmp_path / "score.json"
    scored().write(path)
    content = json.loads(path.read_text(encoding="utf-8"))
    change(content["rows"]["mine"]["runs"][0])
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(f"score.json: {message}")):
        Results.read(path)


@pytest.mark.parametrize("missing", ["kind", "files", "runs"])
def test_a_score_names_its_file_and_its_episodes(missing: str) -> None:
    with pytest.raises(
        ValueError, match=rf"rows\.mine\.{'files' if missing == 'kind' else missing}"
    ):
        scored(**{missing: None if missing == "kind" else ()})
