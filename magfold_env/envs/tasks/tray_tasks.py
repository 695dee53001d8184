"""Trays of components, and what chains of some of them are to reach or bear."""

from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np

from magfold_env.envs.spaces.actions import LYING, PATTERNS
from magfold_env.envs.tasks.feed_tasks import Task
from magfold_env.scene import Problem
from magfold_env.scene.base import Positive
from magfold_env.scene.errors import refuse

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
