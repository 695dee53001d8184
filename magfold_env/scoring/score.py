"""What is handed in, played on draws of a seed, and the result as a file."""

import hashlib
import os
import re
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest, reading_json, write_json
from magfold_env.reporting.intervals import Share, share
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.base import Part
from magfold_env.scene.errors import problems_of, refuse
from magfold_env.scoring import action_file
from magfold_env.scoring.action_file import ActionFile
from magfold_env.scoring.network import Actor
from magfold_env.scoring.player import Player, play
from magfold_env.scoring.track import TRACKS, WIDTH, Track

FORMAT = "magfold_env score 1"
EPISODES = 1000
MINUTES = 10.0

_LIBRARIES = ("magfold_env", "numpy", "numba", "gymnasium")

Ended = tuple[int, bool, float, float | None]
"""Of an episode its task, success, score and energy [J]."""


class Score(Part):
    """How an entry did."""

    format: Literal["magfold_env score 1"] = FORMAT
    name: Annotated[str, Field(pattern=r"^[\w .+-]{1,80}$")]
    """That of its file, without suffix; other characters than these are underscores."""
    kind: Literal["policy", "actions"]
    """Actions may have been chosen with knowledge of the draws."""
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    """Of its file."""
    id: str
    """The environment's name with Gymnasium."""
    seed: int
    """Of the draws."""
    draws: int
    """Version of the draws, see `magfold_env.envs.tasks.draws`."""
    physics: Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
    """See `magfold_env.files.physics_digest`."""
    versions: dict[str, str]
    """Of what played."""
    seconds: float
    """How long it took."""
    episodes: Annotated[tuple[Ended, ...], Field(min_length=1)]
    """Each one's task, success, score and energy at the end [J]: the last of them tell bits of the
    motion apart; None where it broke down."""

    @property
    def success(self) -> Share:
        """Share of the episodes that succeeded."""
        return share(sum(success for _, success, _, _ in self.episodes), len(self.episodes))

    @property
    def score(self) -> float:
        """Mean score."""
        return sum(score for _, _, score, _ in self.episodes) / len(self.episodes)

    def write(self, path: Path) -> None:
        """Write to `path`, under a temporary name first."""
        write_json(path, self.model_dump(mode="json"), "episodes")

    @classmethod
    def read(cls, path: Path) -> "Score":
        """Read what `write` wrote.

        Raises
        ------
        ValueError
            If it is no such file.
        """
        with reading_json(path, "a score", FORMAT) as data:
            content = data
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise SceneError(problems_of(error, cls), str(path)) from None


def track_of(env_id: str, seed: int) -> Track:
    """Return a track on the draws of a seed.

    ``track_of(env_id, seed).draws(0, 1000)`` gives the tasks, by number, and the seeds with which
    ``env.reset(seed=…, options={"task": …})`` begins the same episodes.

    Raises
    ------
    ValueError
        If there is no such track.
    """
    return Track(env_id, stream=f"score {seed}")


def score(
    path: Path,
    env_id: str | None = None,
    seed: int | None = None,
    episodes: int | None = None,
    minutes: float = MINUTES,
    tell: Callable[[int, int], object] = lambda played, wanted: None,
) -> Score:
    """Play what is in a file and return how it did.

    Parameters
    ----------
    path : Path
        A policy (``.safetensors``) or actions (``.json``).
    env_id, seed, episodes
        Of a policy: its environment, the seed of the draws, by default 0, and how many are played,
        by default `EPISODES`. Files of actions say these themselves.
    minutes : float
        The most that it may take.
    tell : callable
        Is called with how many episodes were played, and how many will be.

    Raises
    ------
    ValueError
        If the file or an argument is not allowed, or it takes too long.
    """
    begun = time.monotonic()
    entry: Actor | ActionFile
    if path.suffix == ".json":
        entry = action_file.read(path)
        given = {"env": env_id, "seed": seed, "episodes": episodes}
        told = "must be left out; a file of actions says it"
        refuse([Problem(key, value, told) for key, value in given.items() if value is not None])
        env_id, seed, episodes = entry.id, entry.seed, len(entry.actions)
    else:
        if env_id not in TRACKS:
            why = "python -m agents.evaluate plays the policies of other environments"
            why = "a policy does not say" if env_id is None else why
            allowed = f"must be one of {', '.join(TRACKS)}; {why}"
            raise SceneError([Problem("env", env_id, allowed)])
        entry = Actor.read(path)
    seed = seed or 0
    until = begun + 60.0 * minutes
    try:
        track = track_of(env_id, seed)
        if isinstance(entry, ActionFile):
            action_file.check(entry, track.single_actions.space)
        found = _play(track, entry, episodes or EPISODES, until, tell)
    except TimeoutError:
        raise ValueError(f"{path}: takes longer than the {minutes:g} minutes allowed") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return Score(
        name=re.sub(r"[^\w .+-]", "_", path.stem)[:80],
        kind="policy" if isinstance(entry, Actor) else "actions",
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        id=env_id,
        seed=seed,
        draws=EVALUATION_VERSION,
        physics=physics_digest(),
        versions={name: version(name) for name in _LIBRARIES},
        seconds=round(time.monotonic() - begun, 1),
        episodes=found,
    )


def _play(
    track: Track,
    entry: Actor | ActionFile,
    count: int,
    until: float,
    tell: Callable[[int, int], object],
) -> tuple[Ended, ...]:
    """Return how episodes end, unless they are not over by some moment of `time.monotonic`."""
    room = track.episodes(min(count, WIDTH), threads=os.cpu_count() or 1)
    numbers, seeds = track.draws(0, count)
    found: list[Ended] = []
    tell(0, count)

    def plan_of(part: slice) -> Plan:
        plan = _plan(track, entry, range(count)[part])

        def hurried(episodes: Any, rows: Ints) -> Any:
            if time.monotonic() > until:
                raise TimeoutError
            return plan(episodes, rows)

        return hurried

    for ends in play(room, numbers, seeds, plan_of):
        energies = [None if np.isnan(each) else each for each in ends["energy"].tolist()]
        columns = ends["is_success"].tolist(), ends["score"].tolist(), energies
        found += zip(numbers[len(found) :].tolist(), *columns, strict=False)
        tell(len(found), count)
    return tuple(found)


def _plan(track: Track, entry: Actor | ActionFile, part: range) -> Plan:
    """Return what an entry asks for in some of the episodes."""
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
