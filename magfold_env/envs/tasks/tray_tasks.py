"""Trays of components, what chains of some of them are to reach or bear, and what is hidden."""

from collections.abc import Iterable, Sequence
from typing import Any, ClassVar, Unpack, cast

import numpy as np

from magfold_env.envs.baselines.baseline import chain_name
from magfold_env.envs.chains.arrays import Floats
from magfold_env.envs.spaces.actions import PATTERNS, SIGNS
from magfold_env.envs.spaces.observation import AnchorLayout, TrayLayout
from magfold_env.envs.spaces.tray_actions import FACES, LYING, AnchorTable, TrayTable
from magfold_env.envs.tasks.feed_tasks import FeedOptions, Task, TaskWorld
from magfold_env.envs.tasks.fold_task import feedable
from magfold_env.scene import Problem
from magfold_env.scene.base import Positive
from magfold_env.scene.errors import refuse

DEAD = 0.15
"""Share of the magnets that are dead."""

WEAK = 0.1
"""Share of those that are weak."""

WEAKNESS = 0.3
"""Strength of a weak magnet, and of a sound one 1, both but for `SPREAD`."""

SPREAD = 0.15
"""Largest relative deviation of the strength of a magnet."""

Order = list[tuple[int, int]]
"""Components of a tray, by number, and how they lie: component 1 of the chain first."""


class TrayTask(Task):
    """A tray of components, how a chain of some of them is fed, and the fold to reach."""

    tray: tuple[str, ...]
    """Faces of the components as they come, four letters N or S each."""
    strengths: tuple[tuple[float, float, float, float], ...] | None = None
    """What the strengths of their magnets are multiplied by, if they are not to be drawn."""

    def __init__(self, **data: Any) -> None:
        super().__init__(**data)
        key, wrong = "tray", [faces for faces in self.tray if faces not in PATTERNS]
        problems = [Problem(key, each, "must be four letters N or S") for each in wrong]
        if len(self.tray) < self.n:
            allowed = f"must have {self.n} components or more"
            problems.append(Problem(key, self.tray, allowed))
        if self.strengths is not None and len(self.strengths) != len(self.tray):
            allowed = f"must be {len(self.tray)} times four numbers"
            problems.append(Problem("strengths", self.strengths, allowed))
        refuse(problems)

    @property
    def parts(self) -> tuple[str, ...]:
        """The components that there are."""
        return self.tray

    def order_of(self, sequence: Sequence[str], parts: Iterable[int] | None = None) -> Order | None:
        """Return how a sequence can be had from the tray, the first ways; None if it cannot.

        Of like components those that come first in `parts` are taken, by default in the tray; what
        is not in it stays there.
        """
        left, found = list(range(len(self.tray)) if parts is None else parts), cast("Order", [])
        for faces in sequence:
            pattern = PATTERNS.index(faces)
            for part in left:
                lies = np.flatnonzero(LYING[PATTERNS.index(self.tray[part])] == pattern)
                if lies.size:
                    left.remove(part)
                    found.append((part, int(lies[0])))
                    break
            else:
                return None
        return found


class TrayWorld(TaskWorld):
    """The same where components are taken from trays; parameters are those of `TaskWorld`.

    Raises
    ------
    ValueError
        For any option that is not allowed; the message names it and what is.
    """

    tasks: tuple[TrayTask, ...]
    kind = TrayTask
    shipped = "trays-6"

    table: ClassVar[type[TrayTable]] = TrayTable
    camera: ClassVar[type[TrayLayout]] = TrayLayout

    def _set_spaces(self, **options: Unpack[FeedOptions]) -> None:
        scene = feedable(self.scene, "component")
        sizes = sorted({len(task.tray) for task in self.tasks})
        if len(sizes) != 1:
            raise ValueError(f"tasks: trays of {sizes} components are not allowed; must be alike")
        kind: Any = options.get("actions", "multidiscrete")
        self.actions = self.table(sizes[0], options.get("speeds", 5), kind)
        self.layout = self.camera(scene.n, scene.casing.side, sizes[0])
        self.patterns = np.array(
            [[PATTERNS.index(faces) for faces in task.tray] for task in self.tasks]
        )
        """Numbers of the patterns of the components as they come, (tasks, parts)."""
        self.poles = SIGNS[self.patterns]
        """Their outward poles, (tasks, parts, 4)."""
        self.draws_strengths = options.get("randomisation", "scene") != "none"

    def strengths(self, number: int, rng: Any) -> Floats:
        """Draw what the strengths of a tray's magnets are multiplied by, (parts, 4).

        As much is drawn for every task, so that a seed draws one physics whatever the task.
        """
        kind, spread = rng.random((2, self.actions.parts, len(FACES[0])))
        given = self.tasks[number].strengths
        if given is not None:
            return np.array(given)
        if not self.draws_strengths:
            return np.ones_like(kind)
        weak = np.where(kind < DEAD + WEAK, WEAKNESS, 1.0)
        return np.where(kind < DEAD, 0.0, weak * (1.0 + SPREAD * (2.0 * spread - 1.0)))


class AnchorTask(TrayTask):
    """A tray, how a chain of some of its components is fed, and the pull that its fold must bear.

    Any fold will do. The target is the one that energy minimisation is asked for, by which b and
    the shaping go.
    """

    pull: Positive
    """Size of the pull [N]."""
    towards: float
    """Its direction in the plane [rad], 0 away from the tube."""

    @property
    def aim(self) -> str:
        """The target and the pull."""
        return f"{self.target}-{self.pull:g}N-{self.towards:g}"

    @property
    def name(self) -> str:
        """What its baseline is kept under."""
        return chain_name(self.parts, self.direction, self.aim)


class AnchorWorld(TrayWorld):
    """The same where folds are to bear a pull; parameters are those of `TrayWorld`."""

    kind = AnchorTask
    shipped = "anchors-6"
    table = AnchorTable
    camera = AnchorLayout

    def _set_spaces(self, **options: Unpack[FeedOptions]) -> None:
        super()._set_spaces(**options)
        tasks = cast("tuple[AnchorTask, ...]", self.tasks)
        self.sizes: Floats = np.array([task.pull for task in tasks])
        """Of the pulls [N], (tasks,)."""
        towards = np.array([task.towards for task in tasks])
        self.pulls: Floats = self.sizes[:, None] * np.stack([np.cos(towards), np.sin(towards)], 1)
        """The pulls [N], (tasks, 2)."""
