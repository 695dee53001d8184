"""The score of the minimiser's chain from a tray, at its best constant speed: the baseline b.

Among the sequences that the tray allows, the minimiser takes the one with the largest gap between
the energy of the target and that of its best competitor, assuming sound magnets. It takes equal
components in the order of the tray. The speed is the one at which that chain scores best on the
draws of the stream ``selection``; if several are equally good, it is the slowest. b is the chain's
mean score on the draws of the stream ``scoring``. No component is drawn back.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from magfold_env.designer.exhaustive import Exhaustive
from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.baselines.constant_speed import Plan, TaskStore
from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.spaces.actions import AHEAD, LYING, PATTERNS
from magfold_env.envs.tasks.feed_tasks import Order, TrayTask
from magfold_env.envs.tasks.setup import TaskSetup
from magfold_env.minimiser import sequence_of
from magfold_env.scene import Scene

_KINDS = LYING.min(axis=1).astype(np.int8)  # equal for patterns of the same component


class TrayDesigns:
    """The sequences that fold into one target; the methods return those that a tray allows."""

    def __init__(self, scene: Scene, target: str) -> None:
        self.n = scene.n
        every = Exhaustive(scene, target)
        found = np.flatnonzero(every.gaps > every.tie)
        gaps: Floats = every.gaps[found]
        # Gaps that differ by rounding count as equal, so that rounding does not decide the order.
        ranks = np.argsort(-(gaps / float(gaps.max(initial=0.0))).round(9), kind="stable")
        self.numbers: Ints = found[ranks]
        """Numbers of sequences whose only ground state is the target, the largest gap first."""
        self.gaps: Floats = gaps[ranks]
        """The energy gaps of these sequences [J]."""
        patterns = self._patterns(self.numbers)
        # Only sequences that begin with N are listed, because swapping all poles changes nothing.
        self._kinds = np.stack([_KINDS[patterns], _KINDS[15 - patterns]])

    def best(self, tray: Sequence[str]) -> tuple[str, ...] | None:
        """Return the sequence with the largest gap among those that a tray allows, or None."""
        return next(iter(self.ranked(tray, 1)), None)

    def ranked(self, tray: Sequence[str], count: int) -> list[tuple[str, ...]]:
        """Return up to `count` sequences that a tray allows, the largest gap first."""
        fits = self._fit(tray)
        found = np.flatnonzero(fits.any(axis=0))[:count]
        return [self._sequence(place, bool(fits[0, place])) for place in found.tolist()]

    def _sequence(self, place: int, listed: bool) -> tuple[str, ...]:
        """Return the sequence at index `place`, with all poles swapped unless `listed`."""
        sequence = sequence_of(int(self.numbers[place]), self.n)
        return sequence if listed else tuple(each.translate(_OTHER_POLES) for each in sequence)

    def every(self, tray: Sequence[str]) -> Ints:
        """Return all sequences that a tray allows, the largest gap first, (k, n).

        Entries are pattern numbers, component 1 first.
        """
        place, changed = np.nonzero(self._fit(tray).T)
        patterns = self._patterns(self.numbers[place])
        return np.where(changed[:, None] == 1, 15 - patterns, patterns)

    def _patterns(self, numbers: Ints) -> Ints:
        return (numbers[:, None] >> 4 * np.arange(self.n - 1, -1, -1)) & 15

    def _fit(self, tray: Sequence[str]) -> Bools:
        """Return which sequences a tray allows, as listed and with all poles swapped."""
        had = np.bincount(_KINDS[[PATTERNS.index(faces) for faces in tray]], minlength=16)
        fits = np.ones(self._kinds.shape[:2], dtype=np.bool_)
        for kind in np.unique(_KINDS).tolist():
            fits &= (self._kinds == kind).sum(axis=2) <= had[kind]
        return fits


_OTHER_POLES = str.maketrans("NS", "SN")


class TrayStore(TaskStore):
    """Baselines of trays; the arguments are those of `TaskStore`."""

    def protocol(self, setup: TaskSetup) -> tuple[Any, ...]:
        """Return the constants on which baselines of this kind depend."""
        return (tuple(setup.actions.speeds.tolist()), *self.draws)

    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules to try for a task, as baselines without scores."""
        task: TrayTask = self._setup.tasks[number]
        sequence = TrayDesigns(self._setup.scene, task.target).best(task.tray)
        if sequence is None:
            return []
        return [
            Baseline(task.aim, sequence, speed, 0.0, 0.0, task.direction, tray=task.tray)
            for speed in self._setup.actions.speeds.tolist()
        ]

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        fed: list[Order] = []
        for number, baseline in schedules:
            task: TrayTask = self._setup.tasks[number]
            order = task.order_of(baseline.sequence or ())
            if not order:
                raise ValueError(f"task: the minimiser has no chain for {task.name!r}")
            fed.append(task.as_fed(order))
        speeds = np.array([[each.speed] for _, each in schedules], dtype=np.float64)
        return in_order(np.array(fed), speeds)


def always(task: TrayTask, order: Order, speed: float) -> Plan:
    """Return the plan that feeds the components in `order` at a constant speed [m/s]."""
    fed = np.array(task.as_fed(order))
    return in_order(fed[None], np.array([[speed]]))


def in_order(fed: Ints, speeds: Floats) -> Plan:
    """Return the plan that feeds the components and orientations in `fed`, (1 or m, n, 2).

    `speeds` are the components' speeds [m/s], (1 or m, n), or (1 or m, 1) if they are equal.
    """
    speeds = np.broadcast_to(speeds, (len(fed), fed.shape[1]))

    def plan(episodes: Any, rows: Ints) -> Any:
        # After all components are fed, any feeding action leaves an anchored chain.
        at = rows % len(fed), np.minimum(episodes.arrays.fed[rows], fed.shape[1] - 1)
        part, lie = fed[at].T
        return part, lie, speeds[at], np.full(len(rows), AHEAD)

    return plan
