"""What happens beside the learning: the progress bar, and what is due between two rollouts."""

import time
from collections.abc import Callable
from typing import Self

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from stable_baselines3.common.callbacks import BaseCallback

from agents.training import progress


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
    """Shows steps, episodes' recent rate of success and the time left, in a ``with`` block.

    Parameters
    ----------
    start, end : int
        Steps made before the phase, and at its end.
    description : str
        Name of the phase.
    """

    def __init__(self, start: int, end: int, description: str) -> None:
        super().__init__()
        self._start = start
        self._bar = progress_bar()
        self._task = self._bar.add_task(description, total=end - start, note="")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def _on_step(self) -> bool:
        recent = self.model.ep_success_buffer or [0.0]
        note = f"success {100 * float(np.mean(recent)):.0f} %"
        self._bar.update(self._task, completed=self.num_timesteps - self._start, note=note)
        return True


class BoundaryCallback(BaseCallback):
    """Validates and saves between rollouts, where a run can be taken up again; ends it in time.

    Parameters
    ----------
    state : progress.Progress
        How far the run has come; kept up to date.
    validate_every, save_every : int
        Steps between validations, and between checkpoints.
    validate, save : callable
        What to do then.
    minutes : float, optional
        Time limit of the whole run.
    """

    def __init__(
        self,
        state: progress.Progress,
        validate_every: int,
        save_every: int,
        validate: Callable[[], None],
        save: Callable[[], None],
        minutes: float | None,
    ) -> None:
        super().__init__()
        self._state = state
        self._every = (validate_every, save_every)
        self._validate = validate
        self._save = save
        self._limit = np.inf if minutes is None else 60.0 * minutes
        self._began = time.monotonic() - state.seconds

    @property
    def interrupted(self) -> bool:
        """Whether the phase ended before its steps were made."""
        return self._state.stopping or self.out_of_time

    @property
    def out_of_time(self) -> bool:
        """Whether the time limit of the run is reached."""
        return self._state.seconds >= self._limit

    def visit(self) -> None:
        """Do what is due between two rollouts."""
        state, steps = self._state, self.model.num_timesteps
        if progress.due(steps, state.validated_at, self._every[0]):
            self._validate()
        if progress.due(steps, state.saved_at, self._every[1]):
            state.saved_at = steps
            self._save()

    def _on_rollout_start(self) -> None:
        self.visit()

    def _on_step(self) -> bool:
        self._state.seconds = time.monotonic() - self._began
        return not self.interrupted
