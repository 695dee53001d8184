"""Feed orders, chosen before an episode begins: a tray's components, orientations and speeds.

The first orders feed the minimiser's chain, which is the baseline, at every available speed, the
baseline's speed first. The sequences of all other orders are drawn from those whose only ground
state is the task's target if all magnets are sound; their rank by energy gap is log-uniform. If any
fold is allowed, half of these orders use a uniformly drawn word instead. Of equal components
or equivalent orientations, one is selected at random. Half of the orders have one speed, and half
one speed per component. Open loops use no observations, so they draw back and test no component.

The oracle knows the magnets' strengths in an episode, so components with equal patterns differ for
it. Half of its candidates are the best orders of the task's search. The others are the best of
`KNOWN` orders drawn as above, namely those whose lowest target word has the largest energy gap to
all other words with these strengths. They have the speeds of the search's best orders.
"""

from collections.abc import Iterator, Sequence
from functools import cache, cached_property
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from magfold_env.envs.anchor import AnchorEnv
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.baselines.tray_order import TrayDesigns, in_order
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.spaces.actions import FACES, FASTEST, LYING, SIGNS
from magfold_env.envs.tasks.feed_tasks import TrayTask
from magfold_env.envs.tray import TrayEnv
from magfold_env.minimiser.energies import quadratic_forms
from magfold_env.minimiser.lattice import all_words
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words

KNOWN = 4000
"""Number of orders whose energies are compared for the strengths of an episode."""

Fed = tuple[tuple[int, int], ...]
"""Components, by their places on the tray, and orientations, in the order in which they are fed."""


class FeedOrder(NamedTuple):
    """The components, orientations and speeds that an open loop chooses."""

    family: str
    fed: Fed
    speeds: tuple[float, ...]
    """Feed speeds of the components [m/s]."""

    def __str__(self) -> str:
        """Return the order as text."""
        parts = [
            f"{part} lying {lie} at {speed:.3f} m/s"
            for (part, lie), speed in zip(self.fed, self.speeds, strict=True)
        ]
        return f"{self.family}: {', '.join(parts)}"


class Orders:
    """The open loops of an environment with a tray."""

    def __init__(self, env: TrayEnv) -> None:
        self._env, self._setup = env, env.setup
        n = self._setup.scene.n
        words = (str(word) for word in folded_words(n))
        self._others = tuple(words) if isinstance(env, AnchorEnv) else ()
        self._listed: dict[int, list[Any]] = {}
        self._known: dict[int, Ints] = {}
        self.fastest = FeedOrder("fastest", tuple((part, 0) for part in range(n)), (FASTEST,) * n)
        """The order that feeds a tray's first components, unturned, at the highest speed."""

    def candidates(self, count: int, number: int) -> list[FeedOrder]:
        """Return `count` orders for the task with this number; all differ in poles or speeds.

        A longer list begins with the orders of a shorter list.
        """
        task, baseline = self._env.tasks[number], self._env.baseline_of(number)
        speeds: list[float] = self._setup.actions.speeds.tolist()
        order = task.order_of(baseline.sequence or ())
        assert order
        fed = tuple(task.as_fed(order))
        found = {
            self._key(each, number): each
            for speed in sorted(speeds, key=lambda each: each != baseline.speed)
            for each in (FeedOrder("baseline", fed, (speed,) * task.n),)
        }
        rng = _generator(b"orders", number)
        drawn = self._drawn(number, rng)
        while len(found) < count:
            one = rng.integers(2) == 0
            chosen = tuple(rng.choice(speeds, 1 if one else task.n).tolist())
            name, chosen = ("one speed", chosen * task.n) if one else ("a speed each", chosen)
            each = FeedOrder(name, next(drawn), chosen)
            found.setdefault(self._key(each, number), each)
        return list(found.values())[:count]

    def following(self, found: Sequence[FeedOrder]) -> Plan:
        """Return a plan that plays orders, one per row."""
        fed, speeds = zip(*((each.fed, each.speeds) for each in found), strict=True)
        return in_order(np.array(fed), np.array(speeds))

    def drawn(self) -> tuple[Scene, TrayTask]:
        """Return the current episode's scene and task, including all randomly drawn values."""
        episodes: Any = self._env.episodes
        task: Any = self._env.task
        strengths = tuple(map(tuple, episodes.strengths[0].tolist()))
        return episodes.scene(0), task.model_copy(update={"strengths": strengths})

    def raced(self, best: list[FeedOrder], number: int, task: TrayTask) -> list[FeedOrder]:
        """Return orders for the oracle to try, as many as in `best`, the best of a task's search.

        `number` is the task's number; `task` contains the magnets' strengths.
        """
        kept = best[: (len(best) + 1) // 2]
        if number not in self._known:
            drawn = self._drawn(number, _generator(b"known", number))
            self._known[number] = np.unique([next(drawn) for _ in range(KNOWN)], axis=0)
        fed = self._known[number]
        ranks = np.argsort(-self.gaps(fed, number, task), kind="stable")[: len(best) - len(kept)]
        return kept + [
            FeedOrder("known strengths", tuple(map(tuple, each)), like.speeds)
            for each, like in zip(fed[ranks].tolist(), best, strict=False)
        ]

    def gaps(self, fed: Ints, number: int, task: TrayTask) -> Floats:
        """Return each order's energy gap from its lowest target word to any other word [J], (k,).

        `fed` contains components and orientations, (k, n, 2); `task` contains the strengths.
        """
        part, lie = np.moveaxis(fed if task.direction == "forward" else fed[:, ::-1], 2, 0)
        signs = SIGNS[LYING[self._setup.patterns[number, part], lie]]
        strengths = np.array(task.strengths)[part[..., None], FACES[lie]]
        poles = (signs * strengths).reshape(len(fed), -1)
        words, forms = self._forms
        energies = np.array([((poles @ form) * poles).sum(axis=1) for form in forms])
        wanted = np.flatnonzero(np.isin(words, (task.target, *self._others)))
        lowest = wanted[energies[wanted].argmin(axis=0)], np.arange(len(fed))
        own = energies[lowest]
        energies[lowest] = np.inf
        return energies.min(axis=0) - own

    @cached_property
    def _forms(self) -> tuple[tuple[str, ...], Floats]:
        """All words, and the quadratic forms that give their energies, with sound magnets."""
        lattice = all_words(self._setup.scene.n)
        return lattice.words, quadratic_forms(self._setup.scene, lattice)

    def _drawn(self, number: int, rng: np.random.Generator) -> Iterator[Fed]:
        """Yield an endless sequence of random choices of a tray's components and orientations."""
        listed, ways = self._sequences(number), LYING[self._setup.patterns[number]]
        step = 1 if self._env.tasks[number].direction == "forward" else -1
        while True:
            some = listed[rng.integers(2) * rng.integers(len(listed))]
            sequence = some[int((len(some) + 1) ** rng.random()) - 1]
            left, found = ways.copy(), list[tuple[int, int]]()
            for pattern in sequence.tolist():
                fits = np.argwhere(left == pattern)
                part, lie = fits[rng.integers(len(fits))].tolist()
                left[part] = -1
                found.append((part, lie))
            yield tuple(found[::step])

    def _sequences(self, number: int) -> list[Any]:
        """Return the sequences that a tray allows for each allowed word, the target first."""
        if number not in self._listed:
            task, lists = self._env.tasks[number], list[Any]()
            for word in dict.fromkeys((task.target, *self._others)):
                found = _designs(self._setup.scene, word).every(task.tray)
                lists.append(found.astype(np.int8))
            self._listed[number] = [each for each in lists if len(each)]
        return self._listed[number]

    def _key(self, order: FeedOrder, number: int) -> Any:
        """Return an order's poles and speeds; orders with equal ones are the same in effect."""
        part, lie = np.array(order.fed).T
        return tuple(LYING[self._setup.patterns[number, part], lie].tolist()), order.speeds


@cache
def _designs(scene: Scene, word: str) -> TrayDesigns:
    return TrayDesigns(scene, word)


def _generator(purpose: bytes, number: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(number, spawn_key=(crc32(purpose),)))
