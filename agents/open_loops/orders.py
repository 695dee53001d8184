"""Orders of feed, chosen before an episode begins: components of a tray, how they lie, and speeds.

The first ones are the minimiser's chain, which sets b, at every speed on offer, b's first. Of all
others the sequence is drawn from those whose only ground state by energy is the task's target, all
magnets being sound: its place among them, the largest gap first, is even on a scale of powers.
Where any fold will do, half of them are of a word that is drawn evenly instead. Which of equal
components are taken is drawn, and how they lie where there are several ways. Half of the orders
have one speed, half one a component. Nothing is drawn back or tested: an open loop does not look.

To the oracle, which knows the strengths of an episode, equal components are not alike. Half of what
it races are the orders that came farthest in the task's search. The others are, of `KNOWN` drawn as
above, those whose lowest wanted word lies farthest in energy below all other words with those
strengths; the speeds are those of the best in the search.
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
from magfold_env.envs.tasks.tray_tasks import TrayTask
from magfold_env.envs.tray import TrayEnv
from magfold_env.minimiser.energies import quadratic_forms
from magfold_env.minimiser.lattice import all_words
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words

KNOWN = 4000
"""Orders whose energies are compared at the strengths of an episode."""

Fed = tuple[tuple[int, int], ...]
"""Components, by their places on the tray, and how they lie, in the order of feed."""


class FeedOrder(NamedTuple):
    """What an open loop decides."""

    family: str
    fed: Fed
    speeds: tuple[float, ...]
    """Feed speeds of the components [m/s]."""

    def __str__(self) -> str:
        """Return it in words."""
        parts = [
            f"{part} lying {lie} at {speed:.3f} m/s"
            for (part, lie), speed in zip(self.fed, self.speeds, strict=True)
        ]
        return f"{self.family}: {', '.join(parts)}"


class Orders:
    """The open loops of an environment in which components are taken from a tray."""

    def __init__(self, env: TrayEnv) -> None:
        self._env, self._world = env, env.world
        n = self._world.scene.n
        words = (str(word) for word in folded_words(n))
        self._others = tuple(words) if isinstance(env, AnchorEnv) else ()
        self._listed: dict[int, list[Any]] = {}
        self._known: dict[int, Ints] = {}
        self.fastest = FeedOrder("fastest", tuple((part, 0) for part in range(n)), (FASTEST,) * n)
        """The first components of a tray as they come, at the highest speed."""

    def candidates(self, count: int, number: int) -> list[FeedOrder]:
        """Return so many orders for a task, by its number; all have other poles or speeds.

        The first orders of a long list are those of a short one.
        """
        task, baseline = self._env.tasks[number], self._env.baseline_of(number)
        speeds: list[float] = self._world.actions.speeds.tolist()
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
        """Return what plays orders, one a row."""
        fed, speeds = zip(*((each.fed, each.speeds) for each in found), strict=True)
        return in_order(np.array(fed), np.array(speeds))

    def drawn(self) -> tuple[Scene, TrayTask]:
        """Return scene and task of the environment's episode, with all that was drawn of them."""
        episodes: Any = self._env.episodes
        task: Any = self._env.task
        strengths = tuple(map(tuple, episodes.strengths[0].tolist()))
        return episodes.scene(0), task.model_copy(update={"strengths": strengths})

    def raced(self, best: list[FeedOrder], number: int, task: TrayTask) -> list[FeedOrder]:
        """Return as many orders as came farthest in a task's search, for the oracle to race.

        `number` is the task's, `task` says the strengths.
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
        """Return by how much some orders' lowest wanted word lies below all others [J], (k,).

        `fed` are components and how they lie, (k, n, 2), `task` says the strengths.
        """
        part, lie = np.moveaxis(fed if task.direction == "forward" else fed[:, ::-1], 2, 0)
        signs = SIGNS[LYING[self._world.patterns[number, part], lie]]
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
        """All words, and the forms of their energies with sound magnets."""
        lattice = all_words(self._world.scene.n)
        return lattice.words, quadratic_forms(self._world.scene, lattice)

    def _drawn(self, number: int, rng: np.random.Generator) -> Iterator[Fed]:
        """Yield components of a task's tray, and how they lie, without end."""
        listed, ways = self._sequences(number), LYING[self._world.patterns[number]]
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
        """Return the sequences from a task's tray for every wanted word, its target the first."""
        if number not in self._listed:
            task, lists = self._env.tasks[number], list[Any]()
            for word in dict.fromkeys((task.target, *self._others)):
                found = _designs(self._world.scene, word).every(task.tray)
                lists.append(found.astype(np.int8))
            self._listed[number] = [each for each in lists if len(each)]
        return self._listed[number]

    def _key(self, order: FeedOrder, number: int) -> Any:
        """Return what tells orders apart where equal components are alike: poles and speeds."""
        part, lie = np.array(order.fed).T
        return tuple(LYING[self._world.patterns[number, part], lie].tolist()), order.speeds


@cache
def _designs(scene: Scene, word: str) -> TrayDesigns:
    return TrayDesigns(scene, word)


def _generator(purpose: bytes, number: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(number, spawn_key=(crc32(purpose),)))
