"""The minimiser's chain from a tray at its best constant speed: b where components are taken.

Of the sequences that can be had from the tray, the minimiser takes the one whose target lies
farthest in energy below its best competitor, all magnets being sound; equal components are taken in
the order of the tray. Of the speeds on offer the one is taken at which that chain scores best on
draws of the stream ``selection``, the slowest of equally good ones, and b is its mean score on
those of ``scoring``. Nothing is drawn back.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from magfold_env.designer.exhaustive import Exhaustive
from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.baselines.constant_speed import Plan, TaskStore
from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.spaces.actions import AHEAD, LYING, PATTERNS
from magfold_env.envs.tasks.feed_tasks import TaskWorld
from magfold_env.envs.tasks.tray_tasks import Order, TrayTask
from magfold_env.minimiser import sequence_of
from magfold_env.scene import Scene

_KINDS = LYING.min(axis=1).astype(np.int8)  # the same number for patterns that are one component


class TrayDesigns:
    """Sequences that can be had from trays, for one target.

    Parameters
    ----------
    scene : Scene
        Its casing and its magnets count, and its number of components.
    target : str
        The word.
    """

    def __init__(self, scene: Scene, target: str) -> None:
        self.n = scene.n
        every = Exhaustive(scene, target)
        found = np.flatnonzero(every.gaps > every.tie)
        gaps: Floats = every.gaps[found]
        # Gaps that differ by rounding are equal, so that it does not decide which is first.
        ranks = np.argsort(-(gaps / float(gaps.max(initial=0.0))).round(9), kind="stable")
        self.numbers: Ints = found[ranks]
        """Those of sequences whose only ground state the target is, the largest gap first."""
        self.gaps: Floats = gaps[ranks]
        """Their gaps [J]."""
        patterns = self._patterns(self.numbers)
        # Only sequences that begin with N are listed: all poles may be changed.
        self._kinds = np.stack([_KINDS[patterns], _KINDS[15 - patterns]])

    def best(self, tray: Sequence[str]) -> tuple[str, ...] | None:
        """Return the sequence of largest gap that can be had from a tray, or None."""
        return next(iter(self.ranked(tray, 1)), None)

    def ranked(self, tray: Sequence[str], count: int) -> list[tuple[str, ...]]:
        """Return so many sequences that can be had from a tray, those of largest gap first."""
        fits = self._fit(tray)
        found = np.flatnonzero(fits.any(axis=0))[:count]
        return [self._sequence(place, bool(fits[0, place])) for place in found.tolist()]

    def _sequence(self, place: int, listed: bool) -> tuple[str, ...]:
        """Return a sequence as it is listed, or with all poles changed."""
        sequence = sequence_of(int(self.numbers[place]), self.n)
        return sequence if listed else tuple(each.translate(_OTHER_POLES) for each in sequence)

    def every(self, tray: Sequence[str]) -> Ints:
        """Return all sequences that can be had from a tray, the largest gap first, (k, n).

        Components are numbers of patterns, component 1 first.
        """
        place, changed = np.nonzero(self._fit(tray).T)
        patterns = self._patterns(self.numbers[place])
        return np.where(changed[:, None] == 1, 15 - patterns, patterns)

    def _patterns(self, numbers: Ints) -> Ints:
        return (numbers[:, None] >> 4 * np.arange(self.n - 1, -1, -1)) & 15

    def _fit(self, tray: Sequence[str]) -> Bools:
        """Return which sequences can be had from a tray, as they are and with all poles changed."""
        had = np.bincount(_KINDS[[PATTERNS.index(faces) for faces in tray]], minlength=16)
        fits = np.ones(self._kinds.shape[:2], dtype=np.bool_)
        for kind in np.unique(_KINDS).tolist():
            fits &= (self._kinds == kind).sum(axis=2) <= had[kind]
        return fits


_OTHER_POLES = str.maketrans("NS", "SN")


class TrayStore(TaskStore):
    """The baselines of trays; arguments are those of `TaskStore`."""

    def protocol(self, world: TaskWorld) -> tuple[Any, ...]:
        """Return what baselines of this kind depend on."""
        return (tuple(world.actions.speeds.tolist()), *self.draws)

    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules of a task that are tried, without their scores."""
        task: TrayTask = self._world.tasks[number]
        sequence = TrayDesigns(self._world.scene, task.target).best(task.tray)
        if sequence is None:
            return []
        return [
            Baseline(task.aim, sequence, speed, 0.0, 0.0, task.direction, tray=task.tray)
            for speed in self._world.actions.speeds.tolist()
        ]

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        fed: list[Order] = []
        for number, baseline in schedules:
            task: TrayTask = self._world.tasks[number]
            order = task.order_of(baseline.sequence or ())
            if not order:
                raise ValueError(f"task: {task.name!r} has no chain of the minimiser's")
            fed.append(task.as_fed(order))
        speeds = np.array([[each.speed] for _, each in schedules], dtype=np.float64)
        return in_order(np.array(fed), speeds)


def always(task: TrayTask, order: Order, speed: float) -> Plan:
    """Return the plan of a chain, component 1 first, that is fed at a constant speed [m/s]."""
    fed = np.array(task.as_fed(order))
    return in_order(fed[None], np.array([[speed]]))


def in_order(fed: Ints, speeds: Floats) -> Plan:
    """Return what feeds components and how they lie, (1 or m, n, 2), in the order of feed.

    `speeds` are theirs [m/s], (1 or m, n), or (1 or m, 1) where they have the same.
    """
    speeds = np.broadcast_to(speeds, (len(fed), fed.shape[1]))

    def plan(episodes: Any, rows: Ints) -> Any:
        # An anchor is left when all have been fed, whatever else is said.
        at = rows % len(fed), np.minimum(episodes.arrays.fed[rows], fed.shape[1] - 1)
        part, lie = fed[at].T
        return part, lie, speeds[at], np.full(len(rows), AHEAD)

    return plan
