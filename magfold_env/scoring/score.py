"""Functions that play a submission on the draws of a seed and return its results."""

import hashlib
import os
import re
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.episodes import Columns
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.errors import refuse, unless_positive, unless_whole
from magfold_env.scoring import action_file
from magfold_env.scoring.action_file import ActionFile
from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player, play
from magfold_env.scoring.results import File, Results, Row, Run, summed
from magfold_env.scoring.track import TRACKS, WIDTH, Track

EPISODES = 1000
MINUTES = 10.0

_LIBRARIES = ("magfold_env", "numpy", "numba", "gymnasium")


def track_of(env_id: str, seed: int) -> Track:
    """Return a track with the draws of a seed.

    ``track_of(env_id, seed).draws(0, 1000)`` returns the numbers of the tasks and the seeds with
    which ``env.reset(seed=…, options={"task": …})`` begins the same episodes.
    """
    return Track(env_id, stream=f"score {seed}")


def score(
    path: Path,
    env_id: str | None = None,
    seed: int | None = None,
    episodes: int | None = None,
    minutes: float = MINUTES,
    tell: Callable[[int, int], object] = lambda played, wanted: None,
) -> Results:
    """Play the policy or the actions in a file and return the results.

    Parameters
    ----------
    path : Path
        A policy (``.safetensors``) or actions (``.json``).
    env_id, seed, episodes
        For a policy: its environment, the seed of the draws (0 by default) and the number of
        episodes (`EPISODES` by default). Files of actions contain these values.
    minutes : float
        Time limit [min].
    tell : callable
        Function to call with the numbers of played episodes and of all episodes.

    Raises
    ------
    ValueError
        If the file or an argument is not allowed, or if playing takes too long.
    """
    begun = time.monotonic()
    wrong = unless_positive("minutes", minutes)
    wrong += [] if seed is None else unless_whole("seed", seed, 0)
    wrong += [] if episodes is None else unless_whole("episodes", episodes, 1)
    refuse(wrong)
    entry: Actor | ActionFile
    if path.suffix == ".json":
        entry = action_file.read(path)
        given = {"env": env_id, "seed": seed, "episodes": episodes}
        told = "must be left out; a file of actions contains it"
        refuse([Problem(key, value, told) for key, value in given.items() if value is not None])
        env_id, seed, episodes = entry.id, entry.seed, len(entry.actions)
    else:
        if env_id not in TRACKS:
            why = "python -m agents.evaluate plays the policies of other environments"
            why = "a policy does not contain it" if env_id is None else why
            allowed = f"must be one of {', '.join(TRACKS)}; {why}"
            raise SceneError([Problem("env", env_id, allowed)])
        entry = Actor.read(path)
    seed = 0 if seed is None else seed
    episodes = EPISODES if episodes is None else episodes
    until = begun + 60.0 * minutes
    try:
        track = track_of(env_id, seed)
        if isinstance(entry, ActionFile):
            action_file.check(entry, track.single_actions.space)
        run = _play(track, entry, episodes, until, tell)
    except TimeoutError:
        raise ValueError(f"{path}: takes longer than the {minutes:g} minutes allowed") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    file = File(name=path.name, sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    kind = "policy" if isinstance(entry, Actor) else "actions"
    return Results(
        view="score",
        id=env_id,
        draws=EVALUATION_VERSION,
        seed=seed,
        physics=physics_digest(),
        provenance={
            "seconds": round(time.monotonic() - begun, 1),
            **{name: version(name) for name in _LIBRARIES},
        },
        rows={
            re.sub(r"[^\w .+-]", "_", path.stem)[:80]: Row(
                **summed(run), kind=kind, files=(file,), runs=(run,)
            )
        },
    )


def _play(
    track: Track,
    entry: Actor | ActionFile,
    count: int,
    until: float,
    tell: Callable[[int, int], object],
) -> Run:
    """Play `count` episodes; raise a TimeoutError when `time.monotonic` exceeds ``until``."""
    room = track.episodes(min(count, WIDTH), threads=os.cpu_count() or 1)
    numbers, seeds = track.draws(0, count)
    parts: list[Columns] = []
    tell(0, count)

    def plan_of(part: slice) -> Plan:
        plan = _plan(track, entry, range(count)[part])

        def hurried(episodes: Any, rows: Ints) -> Any:
            if time.monotonic() > until:
                raise TimeoutError
            return plan(episodes, rows)

        return hurried

    for ends in play(room, numbers, seeds, plan_of):
        parts.append(ends)
        tell(min(len(parts) * room.count, count), count)
    columns = ("is_success", "score", "energy")
    success, scores, energies = (np.concatenate([part[key] for part in parts]) for key in columns)
    return Run.of(
        success,
        task=numbers.tolist(),
        score=scores.tolist(),
        energy=[None if np.isnan(each) else each for each in energies.tolist()],
    )


def _plan(track: Track, entry: Actor | ActionFile, part: range) -> Plan:
    """Return the plan by which an entry plays the episodes of a part."""
    if isinstance(entry, Actor):
        env = track.env_of(entry.action_space)
        return Player(entry, entry.settings, env, len(part)).plan(env)
    given, actions = entry.actions[part.start : part.stop], track.single_actions
    lengths = np.array([len(each) for each in given])
    shape = actions.space.shape or ()
    table = np.zeros((len(given), lengths.max(), *shape), dtype=np.float64 if shape else np.int64)
    for row, each in enumerate(given):
        table[row, : len(each)] = np.reshape(each, (-1, *shape))

    taken = np.zeros(len(given), dtype=np.int64)

    def choose(_: Any, rows: Ints) -> Any:
        steps = taken[rows]
        taken[rows] += 1
        if (short := rows[steps >= lengths[rows]]).size:
            raise ValueError(
                f"actions[{part[short[0]]}]: {lengths[short[0]]} actions are not allowed; must "
                "be more, the episode goes on"
            )
        return actions.read(table[rows, steps], len(rows))

    return choose
