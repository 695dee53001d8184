"""Trays of components, and pulls that folds of some of them are to bear."""

from typing import Unpack, cast

import numpy as np

from magfold_env.envs.baselines.baseline import chain_name
from magfold_env.envs.chains.arrays import Floats
from magfold_env.envs.spaces.observation import AnchorLayout
from magfold_env.envs.spaces.tray_actions import AnchorTable
from magfold_env.envs.tasks.feed_tasks import FeedOptions
from magfold_env.envs.tasks.tray_tasks import TrayTask, TrayWorld
from magfold_env.scene.base import Positive


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
