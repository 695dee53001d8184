"""A search by Optuna: its storage, its sampler and its pruners; several processes may share it."""

import logging
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import optuna
from filelock import FileLock

from agents.settings import SettingsError
from agents.tuning.search import Choices, Domain, Search, Trial, run_trial
from magfold_env.checkpoint import difference
from magfold_env.files import physics_digest

FOLDER = "folder"
ENDED = (optuna.trial.TrialState.COMPLETE, optuna.trial.TrialState.PRUNED)

HEARTBEAT = 60
"""Interval of a trial's heartbeat [s]; after twice that time without one, it is resumed."""

with warnings.catch_warnings():
    warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
    _again = optuna.storages.RetryHeartbeatStaleTrialCallback()
    """Queues an interrupted trial again, as the same run."""


def search_here(
    search: Search, output: Path, storage: str | None = None, minutes: float | None = None
) -> list[Trial]:
    """Run the remaining trials; return all completed ones.

    The trials' runs are in `output`, and so is the database of the study, ``study.db``, unless
    `storage` is the SQLAlchemy address of another one. No new trial begins after `minutes`.

    Raises
    ------
    SettingsError
        If the storage holds another search of this name.
    OSError
        If the storage or a trial's run cannot be written.
    """
    output.mkdir(parents=True, exist_ok=True)
    # One of several processes that begin together creates the tables.
    with FileLock(output / "study.lock"):
        study = _open(search, storage or f"sqlite:///{output / 'study.db'}")
    if len(study.get_trials(deepcopy=False, states=ENDED)) < search.settings.trials:
        with _told_by_the_command(output):
            study.optimize(
                partial(_objective, search, output),
                timeout=None if minutes is None else 60.0 * minutes,
                callbacks=[optuna.study.MaxTrialsCallback(search.settings.trials, states=ENDED)],
            )
    finished = study.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    return [
        Trial(_folder(output, trial), trial.value, trial.params)
        for trial in finished
        if trial.value is not None
    ]


@contextmanager
def _told_by_the_command(output: Path) -> Generator[None]:
    """Let the command report what has ended a search."""
    # It would log a traceback.
    logging.getLogger("optuna.study._optimize").setLevel(logging.ERROR)
    try:
        yield
    except (AssertionError, optuna.exceptions.StorageInternalError) as error:
        # The failure of a trial could not be stored either.
        failed = error if isinstance(error, optuna.exceptions.StorageInternalError) else None
        failed = failed or error.__context__
        if not isinstance(failed, optuna.exceptions.StorageInternalError):
            raise
        why = getattr(failed.__cause__, "orig", failed.__cause__)
        raise OSError(f"{output}: the study cannot be written: {why}") from error


def suggest(space: dict[str, Domain], trial: optuna.Trial) -> None:
    """Draw every setting of the space for a trial."""
    for key, domain in space.items():
        if isinstance(domain, Choices):
            trial.suggest_categorical(key, domain.texts)
        elif isinstance(domain.low, int) and isinstance(domain.high, int):
            trial.suggest_int(key, domain.low, domain.high, log=domain.log)
        else:
            trial.suggest_float(key, domain.low, domain.high, log=domain.log)


def _open(search: Search, storage: str) -> optuna.Study:
    """Return the study, new or resumed."""
    settings = search.settings
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        kept = optuna.storages.RDBStorage(
            storage, heartbeat_interval=HEARTBEAT, heartbeat_stale_trial_callback=_again
        )
    study = optuna.create_study(
        storage=kept,
        study_name=settings.name,
        sampler=optuna.samplers.TPESampler(n_startup_trials=settings.startup_trials),
        pruner=_pruner(search),
        direction="maximize",
        load_if_exists=True,
    )
    key = search.key | {"physics": physics_digest()}
    if where := difference(study.user_attrs.get("search", key), key):
        raise SettingsError(
            f"{storage}: holds another search named {settings.name}, {where}; "
            "give this one another name, --output or --storage"
        )
    study.set_user_attr("search", key)
    return study


def _pruner(search: Search) -> optuna.pruners.BasePruner:
    settings = search.settings
    if settings.pruner == "median":
        return optuna.pruners.MedianPruner(settings.startup_trials, settings.least_validations)
    if settings.pruner == "hyperband":
        return optuna.pruners.HyperbandPruner(settings.least_validations, search.validations)
    return optuna.pruners.NopPruner()


def _objective(search: Search, output: Path, trial: optuna.Trial) -> float:
    """Train with a trial's settings and report its validations."""
    suggest(search.settings.space, trial)
    objective = search.settings.objective

    def watch(validation: int, result: dict[str, float]) -> None:
        trial.report(result[objective], validation)
        if trial.should_prune():
            raise optuna.TrialPruned

    folder = _folder(output, trial)
    trial.set_user_attr(FOLDER, folder.name)
    settings = search.run_settings(trial.params, folder.name)
    try:
        return run_trial(settings, folder, watch)[objective]
    except KeyboardInterrupt:
        _again(trial.study, trial.study.trials[trial.number])
        raise


def _folder(output: Path, trial: optuna.Trial | optuna.trial.FrozenTrial) -> Path:
    """Return the run folder of a trial; one that is queued again keeps its first."""
    return output / trial.user_attrs.get(FOLDER, f"trial-{trial.number:04d}")
