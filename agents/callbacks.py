"""What happens beside the learning: progress, checkpoints, validation and the time limit."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from magfold_env.files import replacing


def save_policy(model: BaseAlgorithm, path: Path) -> None:
    """Write `model` to `path` (``.zip``) under a temporary name and move it into place."""
    with replacing(path) as temporary:
        model.save(temporary)


def progress_bar() -> Progress:
    """Return a bar that has room for a rate of success."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )


class ProgressCallback(BaseCallback):
    """Shows steps, episodes' recent rate of success and the time left.

    Parameters
    ----------
    timesteps : int
        Steps of the whole run.
    """

    def __init__(self, timesteps: int) -> None:
        super().__init__()
        self._bar = progress_bar()
        self._task = self._bar.add_task("training", total=timesteps, note="")

    def _on_training_start(self) -> None:
        self._bar.start()

    def _on_step(self) -> bool:
        recent = self.model.ep_success_buffer or [0.0]
        note = f"success {100 * float(np.mean(recent)):.0f} %"
        self._bar.update(self._task, completed=self.num_timesteps, note=note)
        return True

    def _on_training_end(self) -> None:
        self._bar.stop()


class EverySteps(BaseCallback):
    """Calls `action` with the model about every `interval` environment steps.

    Parameters
    ----------
    interval : int
        Steps of all environments together.
    action : callable
        What to do; takes the model and the number of steps made.
    """

    def __init__(self, interval: int, action: Callable[[BaseAlgorithm, int], None]) -> None:
        super().__init__()
        self._interval = interval
        self._action = action
        self._next = interval

    def _on_step(self) -> bool:
        if self.num_timesteps >= self._next:
            self._next += self._interval
            self._action(self.model, self.num_timesteps)
        return True


class TimeLimitCallback(BaseCallback):
    """Ends the training once `minutes` have passed."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self._seconds = 60.0 * minutes
        self._start = 0.0

    def _on_training_start(self) -> None:
        self._start = time.monotonic()

    def _on_step(self) -> bool:
        return time.monotonic() - self._start < self._seconds
