"""One run of training: its phases, and what is kept of it on the way."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import uuid4

import torch
from rich.console import Console
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.vec_env import VecMonitor

from agents.evaluation.episodes import warm_up
from agents.settings.run import Phase, TrainSettings
from agents.training.archive import read_archive, write_archive
from agents.training.callbacks import BoundaryCallback, ProgressCallback
from agents.training.envs import make_training_envs
from agents.training.event_files import cut_events, event_sizes
from agents.training.folder import Resume, RunFolder, Standing
from agents.training.info import RunInfo
from agents.training.learners import enter, make_model, save_policy
from agents.training.loggers import make_logger
from agents.training.progress import Progress
from agents.training.state import MODEL, pack, set_records, unpack_model, unpack_rest
from agents.training.validation import Validation, log_validation
from magfold_env.files import replacing

EPISODES_PER_RECORD = 60
"""How often learners that learn all the time write their numbers."""

Watch = Callable[[int, dict[str, float]], object]
"""Is told the number, from 1, and the result of a validation of the main phase. What it raises
breaks the run off."""


class DivergedError(ArithmeticError):
    """The networks hold numbers that are not finite; nothing can be learned from there on."""


def train(
    settings: TrainSettings,
    path: Path,
    resume: Resume = Resume.AUTO,
    wandb: bool = False,
    watch: Watch | None = None,
) -> Path:
    """Run the training that `settings` describe, or what is left of it.

    Parameters
    ----------
    settings : TrainSettings
        The run.
    path : Path
        Folder of everything that the run writes; see `TrainingRun`.
    resume : Resume
        What to do with an earlier run in the folder.
    wandb : bool
        Whether to log to Weights & Biases too.
    watch : callable, optional
        Follows the validations; may break the run off.

    Returns
    -------
    Path
        The trained policy.

    Raises
    ------
    SettingsError
        If another run lies in the folder, or none where one is to be taken up.
    CheckpointError
        If the checkpoint to take up is damaged, or another run's.
    DivergedError
        If the numbers in the networks break down.
    """
    # The networks are small: more threads only get in the way of the simulations.
    torch.set_num_threads(1)
    folder = RunFolder(path, settings)
    standing = folder.open(resume)
    if standing is Standing.FINISHED:
        return folder.policy
    parts = read_archive(folder.state, folder.key) if standing is Standing.BROKEN_OFF else None
    with Console().status("preparing the engine; its first use compiles it, for up to a minute"):
        for phase in settings.phases:
            warm_up(phase.env)
    run = TrainingRun(folder, parts, wandb, watch)
    run.finish()
    return folder.policy


class TrainingRun:
    """A run under way, and its folder.

    What lies there:

    - ``settings.yaml`` and ``run.json``: everything it was made from and with, and its standing;
    - TensorBoard's files;
    - ``checkpoints/``: the policies on the way; ``best.zip``: the one that validated best;
    - ``resume.zip``: where it goes on after an interruption; it holds pickles, so take up only
      your own runs;
    - at the end ``policy.zip``.

    Parameters
    ----------
    folder : RunFolder
        Where, and the settings.
    parts : dict, optional
        The state to go on from.
    wandb : bool
        Whether to log to Weights & Biases too.
    watch : callable, optional
        Follows the validations of the main phase.
    """

    def __init__(
        self,
        folder: RunFolder,
        parts: dict[str, bytes] | None,
        wandb: bool,
        watch: Watch | None = None,
    ) -> None:
        settings = folder.settings
        self._folder = folder
        self._settings = settings
        self._key = folder.key
        self._model: BaseAlgorithm | None = None
        self._parts = parts
        self._watch = watch
        self._progress = Progress()
        info = RunInfo.begin(settings.name, settings.learner.algorithm, settings.seed)
        if parts is not None:
            state = unpack_rest(parts)
            self._progress = state.progress
            info = RunInfo.read(folder.path) or info
            info.resumed_at.append(self._progress.saved_at)
            cut_events(folder.path, state.events)
        if wandb and info.wandb_id is None:
            info.wandb_id = uuid4().hex
        self._info = info
        self._logger = make_logger(folder.path, settings, info)

    def finish(self) -> None:
        """Train to the end and save the policy."""
        self._info.write(self._folder.path)
        try:
            self._learn_all()
            if self._model is not None:
                save_policy(self._model, self._folder.policy)
            self._info.finished = True
        finally:
            self._note()
            self._logger.close()
        self._folder.state.unlink(missing_ok=True)

    def _learn_all(self) -> None:
        """Train through the phases that are left."""
        progress, phases = self._progress, self._settings.phases
        out_of_time = False
        while progress.phase < len(phases) and not out_of_time:
            envs = make_training_envs(self._settings, progress.phase)
            try:
                out_of_time = self._learn(self._model_in(envs), envs, phases[progress.phase])
            except ValueError as error:
                self._check_finite(error)
                raise
            finally:
                envs.close()

    def _check_finite(self, error: ValueError) -> None:
        """Raise if numbers broke down, which torch says at length when it shall draw actions."""
        model = self._model
        if model is None or all(bool(each.isfinite().all()) for each in model.policy.parameters()):
            return
        raise DivergedError(
            f"after {model.num_timesteps} steps the networks hold numbers that are not finite; "
            "a smaller learner.learning_rate may help"
        ) from error

    def _learn(self, model: BaseAlgorithm, envs: VecMonitor, phase: Phase) -> bool:
        """Train to the end of a phase; return whether the run's time is over."""
        settings, progress = self._settings, self._progress
        start, end = progress.phase_start, progress.phase_start + phase.timesteps
        rate: Any = model.learning_rate
        rate.start, rate.end = start, end
        validation = Validation(phase.env, settings.validation_episodes)
        boundaries = BoundaryCallback(
            progress,
            settings.validate_every,
            settings.checkpoint_every,
            lambda: self._validate(model, validation, phase),
            lambda: self._save(model, envs),
            settings.minutes,
        )
        boundaries.init_callback(model)
        if model.num_timesteps < end:
            name = f"training {progress.phase + 1}/{len(settings.phases)}"
            with ProgressCallback(start, end, name) as bar:
                model.learn(
                    end - model.num_timesteps,
                    callback=[bar, boundaries],
                    log_interval=self._log_interval(model),
                    reset_num_timesteps=False,
                )
            if not boundaries.interrupted:
                boundaries.visit()
        if progress.validated_at < model.num_timesteps:
            self._validate(model, validation, phase)
        progress.next_phase(model.num_timesteps)
        return boundaries.out_of_time

    def _model_in(self, envs: VecMonitor) -> BaseAlgorithm:
        """Return the model, made, taken up or brought along, with its environments."""
        settings = self._settings
        if self._model is not None:
            enter(self._model, envs)
        elif self._parts is not None:
            state = unpack_rest(self._parts)
            algorithm = settings.learner.algorithm
            self._model = unpack_model(self._parts, state, algorithm, envs, settings.device)
            self._model.set_logger(self._logger)
            set_records(self._logger, state)
            self._parts = None
        else:
            self._model = make_model(settings.learner, envs, settings.seed, settings.device)
            self._model.set_logger(self._logger)
        return self._model

    def _log_interval(self, model: BaseAlgorithm) -> int:
        """Return the updates, or the episodes, from one record to the next."""
        if isinstance(model, OnPolicyAlgorithm):
            return 1
        # No more than one record where the episodes of all environments end together.
        return max(EPISODES_PER_RECORD, self._settings.envs)

    def _validate(self, model: BaseAlgorithm, validation: Validation, phase: Phase) -> None:
        """Validate, log it and keep the policy if it is the best."""
        result = validation(model)
        log_validation(model, result)
        self._progress.validated_at = model.num_timesteps
        if self._progress.note(result, phase.stop):
            save_policy(model, self._folder.best)
        if self._watch is not None and self._progress.phase == len(self._settings.phases) - 1:
            self._watch(self._progress.validations, result)

    def _save(self, model: BaseAlgorithm, envs: VecMonitor) -> None:
        """Write a checkpoint to go on from, and the policy as it is."""
        parts = pack(model, envs, self._progress, event_sizes(self._folder.path))
        write_archive(self._folder.state, self._key, parts)
        policy = self._folder.checkpoints / f"policy-{model.num_timesteps:09d}.zip"
        with replacing(policy) as temporary:
            temporary.write_bytes(parts[MODEL])
        self._note()

    def _note(self) -> None:
        """Bring ``run.json`` up to date."""
        if self._model is not None:
            self._info.steps = self._model.num_timesteps
        self._info.seconds = self._progress.seconds
        self._info.validation = self._progress.last
        self._info.write(self._folder.path)
