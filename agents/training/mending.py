"""A player of the anchor's environment that tests chains and rebuilds bad ones, for imitation.

If a tray contains bad magnets, the first chain often fails, and a test shows this while the chain
can still be changed: it withstands less than the pull, or is not folded. The player then draws it
back, except for its first component, and builds another chain with the same fold. A search selects
each task's chains on draws of a separate stream: the first chain on all draws, and every later one
on the draws in which the earlier ones fail. The search is stored beside the runs. Such a player is
of no use in ``MagFold/Tray-v0``, where only the last component shows whether a chain is right.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.settings import EnvSettings
from agents.training.envs import make_env
from agents.training.open_loops import kept_search
from magfold_env.envs.anchor import AnchorEpisodes
from magfold_env.envs.baselines.tray_order import TrayDesigns
from magfold_env.envs.chains.arrays import Bools, Ints
from magfold_env.envs.spaces.actions import AHEAD, BACK, PULL, TrayChoice
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import TrayTask

STREAM = "mending"
"""Name of the random stream that draws the episodes for selecting chains."""

DRAWS = 48
SEQUENCES = 60
"""Largest number of sequences tried per task, in order of decreasing gap."""

TRIED = 40
"""Largest number of chains that are compared."""

CHAINS = 4
"""Largest number of chains built in an episode."""

SPEED_BACK = 0.28
"""Approximate speed at which components are drawn back [m/s]."""

PATIENCE = 0.75
"""Share of the time limit after which no more components are drawn back."""

BEARS = 0.9
"""A chain that withstands this share of a pull in a test counts as withstanding all of it."""


class Chain(NamedTuple):
    """Components from the tray, their orientations and their feed speed."""

    fed: tuple[tuple[int, int], ...]
    """Components and orientations, in the order in which they are fed."""
    speed: float
    """Feed speed of all components [m/s]."""


class Mending:
    """A plan that builds and tests chains, one after another, in every row of episodes.

    `ways` contains the chains of each row, which all have the same first component.
    """

    def __init__(self, ways: Sequence[Sequence[Chain]]) -> None:
        self._ways = ways
        self.at: Ints = np.zeros(len(ways), dtype=np.int64)
        """Index of the current chain of every row, from 0."""
        self._back: Bools = np.zeros(len(ways), dtype=np.bool_)

    def __call__(self, episodes: AnchorEpisodes, rows: Ints) -> TrayChoice:
        """Return the next actions of the given rows."""
        self._judge(episodes, rows)
        fed, n = episodes.arrays.fed[rows], episodes.setup.scene.n
        self._back[rows] &= fed > 1
        chains = [self._ways[row][place] for row, place in zip(rows, self.at[rows], strict=True)]
        # When the chain is complete, only the kind of step matters.
        pairs = zip(chains, np.minimum(fed, n - 1), strict=True)
        parts, lies = np.array([chain.fed[place] for chain, place in pairs]).T
        back = self._back[rows]
        # A row with only one chain does not need a test.
        test = np.array([len(self._ways[row]) > 1 for row in rows.tolist()])
        test &= episodes.is_whole(rows) & ~back & ~episodes.is_tested(rows)
        speeds = np.where(back, SPEED_BACK, [each.speed for each in chains])
        return parts, lies, speeds, np.where(back, BACK, np.where(test, PULL, AHEAD))

    def _judge(self, episodes: AnchorEpisodes, rows: Ints) -> None:
        """Start drawing back the chains that have failed a test, if others are left to build."""
        left = [len(self._ways[row]) - 1 - self.at[row] for row in rows.tolist()]
        holds = episodes.turned(rows).all(axis=1) & (episodes.borne(rows) >= BEARS)
        failed = episodes.is_whole(rows) & episodes.is_tested(rows) & ~holds
        failed &= (np.array(left) > 0) & (episodes.times(rows) < PATIENCE * episodes.late)
        self.at[rows] += failed
        self._back[rows] |= failed


def mended(settings: EnvSettings, folder: Path, draws: int = DRAWS) -> list[tuple[Chain, ...]]:
    """Return the chains to build one after another for every task of an environment.

    All runs share the search in `folder`; `draws` is the number of draws on which the chains of a
    task are compared.
    """
    env: Any = make_env(settings).unwrapped
    jobs = [(settings, number, draws) for number in range(len(env.tasks))]
    key = {"mending": {"draws": draws}}
    found: list[Any] = kept_search("chains to mend with", settings, key, folder, _search, jobs)
    return [tuple(Chain(tuple(map(tuple, fed)), speed) for fed, speed in each) for each in found]


def _search(settings: EnvSettings, number: int, draws: int) -> list[Chain]:
    """Return the chains for the task with this number."""
    env: Any = make_env(settings).unwrapped
    task, speeds = env.tasks[number], env.actions.speeds.tolist()
    seeds, rng = episode_seeds(STREAM, draws), np.random.default_rng([number])
    sequences = TrayDesigns(env.setup.scene, task.target).ranked(task.tray, SEQUENCES)
    chains: list[Chain] = []
    left = np.ones(draws, dtype=np.bool_)
    while len(chains) < CHAINS and left.any():
        tried = _tried(task, sequences, chains, speeds, rng)
        if not tried:
            break
        success = _ends(env, number, tried, [seeds[k] for k in np.flatnonzero(left)])
        best = int(success.sum(axis=1).argmax())
        if chains and not success[best].any():
            break
        chains.append(tried[best])
        left[left] = ~success[best]
    return chains


def _tried(
    task: TrayTask,
    sequences: Sequence[tuple[str, ...]],
    chains: Sequence[Chain],
    speeds: Sequence[float],
    rng: np.random.Generator,
) -> list[Chain]:
    """Return chains to try after `chains`, preferably of the components used least so far."""
    if not chains:
        orders: list[Any] = [task.order_of(each) for each in sequences[: TRIED // 2]]
        best, *others = (tuple(task.as_fed(order)) for order in orders)
        return [Chain(best, speed) for speed in speeds] + [
            Chain(each, float(rng.choice(speeds))) for each in others
        ]
    first, used = chains[0].fed[0], np.zeros(len(task.tray))
    for chain in chains:
        used[[part for part, _ in chain.fed]] += 1.0
    parts = np.argsort(used + rng.random(used.size) * 0.5).tolist()
    parts = [part for part in parts if part != first[0]]
    found: dict[Any, None] = {}
    for sequence in sequences:
        own = task.as_fed(sequence)
        at_first = task.order_of(own[:1], first[:1])
        rest = task.order_of(own[1:], parts)
        if at_first == [first] and rest is not None:
            found[(first, *rest)] = None
    known = {chain.fed for chain in chains}
    fresh = [each for each in found if each not in known][:TRIED]
    return [Chain(each, float(rng.choice(speeds[1:-1]))) for each in fresh]


def _ends(env: Any, number: int, tried: Sequence[Chain], seeds: Sequence[int]) -> Bools:
    """Return which untested chains succeed on which draws, (chains, draws)."""
    count = len(tried) * len(seeds)
    episodes: Any = env.make_episodes(env.setup, count)
    plan = Mending([(chain,) for chain in tried for _ in seeds])
    ends = episodes.play(list(seeds) * len(tried), [number] * count, partial(plan, episodes))
    return ends["is_success"].reshape(len(tried), len(seeds))
