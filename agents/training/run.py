"""A training run: its phases, its validations and its stored files."""

import pickle
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from rich.console import Console
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common import base_class, callbacks, logger, on_policy_algorithm, vec_env

from agents.commands import progress_bar
from agents.evaluation.episodes import warm_up
from agents.settings import (
    EnvSettings,
    ObservationForm,
    Phase,
    PPOSettings,
    SettingsError,
    TrainSettings,
)
from agents.training import folder as run_folder
from agents.training import models, policy_files
from agents.training.envs import make_env, make_training_envs
from agents.training.imitation import imitate
from magfold_env.checkpoint import alone_in
from magfold_env.envs.episodes import Episodes
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.parallel import threads_of
from magfold_env.scoring.player import Player, play
from magfold_env.scoring.track import choice_of_tasks

LARGE = 1024
"""Size of minibatches from which on torch uses all cores."""
EPISODES_PER_RECORD = 60
"""Number of episodes after which off-policy learners write their records."""

Watch = Callable[[int, dict[str, float]], object]
"""A function that is called with the number, from 1, and the result of each validation of the main
phase. An exception that it raises ends the run."""


class DivergedError(ArithmeticError):
    """The networks contain numbers that are not finite, so they can learn no further."""


def train(
    settings: TrainSettings,
    path: Path,
    resume: bool | None = None,
    watch: Watch | None = None,
) -> Path:
    """Run the training that `settings` describe, or the rest of it; return the policy's file.

    All files of the run are in the folder `path` (see `TrainingRun`); `RunFolder.open` describes
    `resume`. `watch` is called after validations.

    Raises
    ------
    SettingsError
        If the folder contains another run or no run to resume, or the initial policy is not
        suitable.
    CheckpointError
        If the checkpoint to resume is damaged or belongs to another run, or a run is active in the
        folder.
    DivergedError
        If the networks contain numbers that are not finite after an update.
    """
    # Simulations and updates take turns. More threads pay off for large minibatches only.
    torch.set_num_threads(threads_of(None) if settings.learner.batch_size >= LARGE else 1)
    folder = run_folder.RunFolder(path, settings)
    if settings.start is not None and not folder.state.is_file():
        # Check the initial policy before anything is written to the folder.
        envs = make_training_envs(settings, 0)
        _make_model(settings, envs)
        envs.close()
    with alone_in(path):
        if not folder.open(resume):
            return folder.policy
        parts = models.read_archive(folder.state, folder.key) if folder.state.is_file() else None
        preparing = "preparing the engine; its first use compiles it, for up to a minute"
        with Console().status(preparing):
            for phase in settings.phases:
                warm_up(phase.env)
        TrainingRun(folder, parts, watch).finish()
    return folder.policy


def _make_model(
    settings: TrainSettings, envs: vec_env.VecEnv
) -> tuple[base_class.BaseAlgorithm, int]:
    """Return the initial model of a run, and the number of steps of its earlier training."""
    model = models.make_model(settings.learner, envs, settings.seed, settings.device)
    if settings.start is None:
        return model, 0
    try:
        return model, policy_files.begin_with(settings.start, model, settings.learner)
    except ValueError as error:
        raise SettingsError(f"start: {error}") from None


class Validation:
    """Plays episodes in parallel, with all targets in turn and the most probable actions.

    Training and reported results use other draws.
    """

    def __init__(self, settings: EnvSettings, episodes: int, shown: ObservationForm) -> None:
        self._env: Any = make_env(settings.unshaped()).unwrapped
        self._shown = shown
        self._seeds = episode_seeds("validation", episodes)
        setup = self._env.setup
        tasks = len(setup.words)
        # Tasks come with the easiest first, so fewer episodes are spread over all of them.
        self._numbers = np.resize(choice_of_tasks(tasks, min(episodes, tasks)), episodes)
        self._episodes: Episodes[Any] = self._env.make_episodes(setup, episodes)

    def __call__(self, model: base_class.BaseAlgorithm) -> dict[str, float]:
        """Return the success rate and the mean score of `model`."""
        plan = Player(model.policy, self._shown, self._env, self._episodes.count).plan(self._env)
        (ends,) = play(self._episodes, self._numbers, self._seeds, lambda _: plan)
        return {
            "success_rate": float(np.mean(ends["is_success"])),
            "score": float(np.mean(ends["score"])),
        }


class BoundaryCallback(callbacks.BaseCallback):
    """Validates and saves between rollouts, where runs can be resumed, and enforces the time limit.

    It updates `state` and calls `validate` and `save` when either is due.
    """

    def __init__(
        self,
        state: models.Progress,
        settings: TrainSettings,
        validate: Callable[[], None],
        save: Callable[[], None],
    ) -> None:
        super().__init__()
        self._state, self._settings = state, settings
        self._validate, self._save = validate, save
        self._limit = np.inf if settings.minutes is None else 60.0 * settings.minutes
        self._began = time.monotonic() - state.seconds
        self._turned: float | None = None  # when the last rollout or update ended

    @property
    def out_of_time(self) -> bool:
        """Whether the run has reached its time limit."""
        return self._state.seconds >= self._limit

    def visit(self) -> None:
        """Perform the actions that are due between two rollouts."""
        state, steps = self._state, self.model.num_timesteps
        # Both are due when a multiple of their interval has been passed since the last time.
        every = self._settings.validate_every
        if steps // every > state.validated_at // every:
            self._validate()
        every = self._settings.checkpoint_every
        if steps // every > state.saved_at // every:
            state.saved_at = steps
            self._save()

    def _on_rollout_start(self) -> None:
        self._record_time("update")
        self.visit()
        learner, model = self._settings.learner, cast("Any", self.model)
        if isinstance(learner, PPOSettings) and learner.anneal_entropy:
            falling = replace(model.learning_rate, rate=learner.ent_coef, anneal=True)
            model.ent_coef = falling(1.0 - model.num_timesteps / falling.end)
        self._turned = time.monotonic()

    def _on_rollout_end(self) -> None:
        self._record_time("rollout")

    def _record_time(self, name: str) -> None:
        """Record the time since the last rollout or update [s]."""
        now = time.monotonic()
        if self._turned is not None:
            self.logger.record(f"time/{name}", now - self._turned)
        self._turned = now

    def _on_step(self) -> bool:
        self._state.seconds = time.monotonic() - self._began
        return not (self._state.stopping or self.out_of_time)


class TrainingRun:
    """A training run and its folder.

    The folder contains:

    - ``settings.yaml`` and ``run.json``: the inputs, the software and the status;
    - TensorBoard's files;
    - ``checkpoints/``: intermediate policies; ``best.safetensors``: the best one in validations;
    - ``resume.zip``: the state for resumption; it contains pickles, so resume only your own runs;
    - ``policy.safetensors``: the policy at the end.

    The run continues from the state in `parts`, if there is one.
    """

    def __init__(
        self,
        folder: run_folder.RunFolder,
        parts: dict[str, bytes] | None,
        watch: Watch | None = None,
    ) -> None:
        settings = folder.settings
        self._folder, self._settings, self._key = folder, settings, folder.key
        self._parts, self._watch = parts, watch
        self._model: base_class.BaseAlgorithm | None = None
        self._progress = models.Progress()
        info = run_folder.RunInfo.begin(settings.name, settings.learner.algorithm, settings.seed)
        if parts is not None:
            rest: dict[str, Any] = pickle.loads(parts[models.REST])
            self._progress = rest["progress"]
            info = run_folder.RunInfo.read(folder.path) or info
            info.resumed_at.append(self._progress.saved_at)
            run_folder.cut_events(folder.path, rest["events"])
        self._info = info
        self._logger = logger.Logger(
            str(folder.path), [logger.TensorBoardOutputFormat(str(folder.path))]
        )

    def finish(self) -> None:
        """Train through the remaining phases and save the policy."""
        progress, phases = self._progress, self._settings.phases
        self._info.write(self._folder.path)
        out_of_time = False
        try:
            while progress.phase < len(phases) and not out_of_time:
                envs = make_training_envs(self._settings, progress.phase)
                try:
                    out_of_time = self._learn(self._model_in(envs), envs, phases[progress.phase])
                finally:
                    envs.close()
            if self._model is not None:
                self._write(self._model, self._folder.policy)
            self._info.finished = True
        except ValueError as error:
            # torch's own message about numbers that are not finite is long.
            model = self._model
            if model is None or all(bool(x.isfinite().all()) for x in model.policy.parameters()):
                raise
            raise DivergedError(
                f"after {model.num_timesteps} steps the networks hold numbers that are not finite; "
                "a smaller learner.learning_rate may help"
            ) from error
        finally:
            self._note()
            self._logger.close()

    def _learn(
        self, model: base_class.BaseAlgorithm, envs: vec_env.VecMonitor, phase: Phase
    ) -> bool:
        """Train to the end of a phase; return whether the run has reached its time limit."""
        settings, progress = self._settings, self._progress
        start, end = progress.phase_start, progress.phase_start + phase.timesteps
        rate: Any = model.learning_rate
        rate.start, rate.end = start, end
        validation = Validation(phase.env, settings.validation_episodes, settings.learner)
        boundaries = BoundaryCallback(
            progress,
            settings,
            validate=lambda: self._validate(model, validation, phase),
            save=lambda: self._save(model, envs),
        )
        boundaries.init_callback(model)
        if model.num_timesteps < end:
            on_policy = isinstance(model, on_policy_algorithm.OnPolicyAlgorithm)
            name = f"training {progress.phase + 1}/{len(settings.phases)}"
            with progress_bar() as bar:
                task = bar.add_task(name, total=end - start, note="")

                def show(*_: object) -> bool:
                    recent = float(np.mean(model.ep_success_buffer or [0.0]))
                    note = f"success {100 * recent:.0f} %"
                    bar.update(task, completed=model.num_timesteps - start, note=note)
                    return True

                model.learn(
                    end - model.num_timesteps,
                    callback=[callbacks.ConvertCallback(show), boundaries],
                    # Off policy, write at most once when the episodes of all environments end
                    # together.
                    log_interval=1 if on_policy else max(EPISODES_PER_RECORD, settings.envs),
                    reset_num_timesteps=False,
                )
            if not (progress.stopping or boundaries.out_of_time):
                boundaries.visit()
        if progress.validated_at < model.num_timesteps:
            self._validate(model, validation, phase)
        if boundaries.out_of_time or progress.phase == len(settings.phases) - 1:
            # A longer run would continue here.
            progress.saved_at = model.num_timesteps
            self._keep(model, envs)
        progress.next_phase(model.num_timesteps)
        return boundaries.out_of_time

    def _model_in(self, envs: vec_env.VecMonitor) -> base_class.BaseAlgorithm:
        """Return the model, which is new, resumed or continued, with `envs` as its environments."""
        settings = self._settings
        if self._model is not None:
            models.enter(self._model, envs)
        elif self._parts is not None:
            self._model = models.unpack_model(self._parts, settings, envs, self._logger)
            self._parts = None
        else:
            self._model, self._progress.before = _make_model(settings, envs)
            if settings.imitate is not None:
                model = cast("PPO | RecurrentPPO", self._model)
                imitate(model, settings, self._folder.path.parent)
            self._info.start = run_folder.file_digest(settings.start) if settings.start else None
            self._model.set_logger(self._logger)
        return self._model

    def _validate(
        self, model: base_class.BaseAlgorithm, validation: Validation, phase: Phase
    ) -> None:
        """Validate, log the result, and keep the policy if it is the best."""
        result = validation(model)
        # A separate logger, because the model's recorded values belong to a later step.
        own = logger.Logger(None, model.logger.output_formats)
        for name, value in result.items():
            own.record(f"validation/{name}", value)
        own.dump(model.num_timesteps)
        self._progress.validated_at = model.num_timesteps
        if self._progress.note(result, phase.stop):
            self._write(model, self._folder.best)
        if self._watch is not None and self._progress.phase == len(self._settings.phases) - 1:
            self._watch(self._progress.validations, result)

    def _save(self, model: base_class.BaseAlgorithm, envs: vec_env.VecMonitor) -> None:
        """Write a checkpoint for resumption and the current policy."""
        self._keep(model, envs)
        name = f"policy-{model.num_timesteps:09d}.safetensors"
        self._write(model, self._folder.checkpoints / name)
        self._note()

    def _keep(self, model: base_class.BaseAlgorithm, envs: vec_env.VecMonitor) -> None:
        """Write the state for resumption."""
        parts = models.pack(model, envs, self._progress, run_folder.event_sizes(self._folder.path))
        models.write_archive(self._folder.state, self._key, parts)

    def _write(self, model: base_class.BaseAlgorithm, path: Path) -> None:
        policy_files.save(model, path, self._settings.learner, self._progress.before)

    def _note(self) -> None:
        """Update ``run.json``."""
        if self._model is not None:
            self._info.steps = self._model.num_timesteps
        self._info.seconds = self._progress.seconds
        self._info.validation = self._progress.last
        self._info.write(self._folder.path)
