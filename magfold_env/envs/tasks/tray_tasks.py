"""Tasks with trays of components: the fold that a chain must reach or the pull it must bear."""

from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np

from magfold_env.envs.spaces.actions import LYING, PATTERNS
from magfold_env.envs.tasks.feed_tasks import Task
from magfold_env.scene import Problem
from magfold_env.scene.base import Positive
from magfold_env.scene.errors import refuse

Order = list[tuple[int, int]]
"""Components of a tray, by number, and their orientations; component 1 of the chain first."""


class TrayTask(Task):
    """A tray of components, the direction of feed and the fold to reach."""

    tray: tuple[str, ...]
    """Faces of the components on the tray, four letters N or S each."""
    strengths: tuple[tuple[float, float, float, float], ...] | None = None
    """Factors of the strengths of the magnets; None to draw them."""

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
        """The available components."""
        return self.tray

    def order_of(self, sequence: Sequence[str], parts: Iterable[int] | None = None) -> Order | None:
        """Return the first way to take a sequence from the tray, or None if there is none.

        Of equal components, those that come first in `parts` are taken (by default, first on the
        tray); components not listed in it stay there.
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
    """A tray of components, the direction of feed and the pull that the fold must bear.

    Any fold counts. b and the shaping use the target.
    """

    pull: Positive
    """Size of the pull [N]."""
    towards: float
    """Direction of the pull in the plane [rad], 0 away from the tube."""

    @property
    def aim(self) -> str:
        """The target and the pull."""
        return f"{self.target}-{self.pull:g}N-{self.towards:g}"
