"""Where a training run is logged: TensorBoard, and Weights & Biases if wanted."""

from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.logger import KVWriter, Logger, TensorBoardOutputFormat

from agents.settings.run import SettingsError, TrainSettings
from agents.training.info import RunInfo


class WandbWriter(KVWriter):
    """Sends every number to a run of Weights & Biases.

    Parameters
    ----------
    run : wandb.Run
        The run.
    """

    def __init__(self, run: Any) -> None:
        self._run = run

    def write(
        self,
        key_values: dict[str, Any],
        key_excluded: dict[str, tuple[str, ...]],
        step: int = 0,
    ) -> None:
        """Send the numbers that TensorBoard gets too."""
        numbers = {
            key: float(value)
            for key, value in key_values.items()
            if "tensorboard" not in key_excluded[key] and isinstance(value, (int, float, np.number))
        }
        self._run.log(numbers, step=step)

    def close(self) -> None:
        """End the run."""
        self._run.finish()


def import_wandb() -> Any:
    """Return the module ``wandb``.

    Raises
    ------
    SettingsError
        If it is not installed.
    """
    try:
        import wandb  # noqa: PLC0415 (wanted by few)  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise SettingsError("--wandb: needs the package wandb: pip install wandb") from None
    return wandb


def make_logger(folder: Path, settings: TrainSettings, info: RunInfo) -> Logger:
    """Return a logger of TensorBoard files in `folder`, and of W&B if the run has a name there."""
    writers: list[KVWriter] = [TensorBoardOutputFormat(str(folder))]
    if info.wandb_id is not None:
        run = import_wandb().init(
            project="magfold_env",
            name=settings.name,
            id=info.wandb_id,
            resume="allow",
            dir=str(folder),
            config=settings.model_dump(mode="json"),
        )
        writers.append(WandbWriter(run))
    return Logger(str(folder), writers)
