"""Search for hyper-parameters with Optuna: ``python -m agents.tune CONFIG``.

A study is stored in ``study.db`` in its folder, beside the runs of its trials. Several processes
may share a study, and an interrupted trial continues from its checkpoint.
"""

import json
import logging
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import typer
from filelock import FileLock
from pydantic import Field, model_validator

from agents import settings as train_settings
from agents.commands import Assignments, needing, run_command, text_table
from agents.settings import SettingsError
from agents.training import envs, run
from agents.training.folder import RunInfo
from magfold_env.checkpoint import difference
from magfold_env.cli import options
from magfold_env.files import physics_digest
from magfold_env.scene import Problem, SceneError, errors, io

HEARTBEAT = 60
"""Time between a trial's heartbeats [s]; a trial is resumed after twice that time without one."""

SHOWN = 10
"""Number of the best trials that the command prints."""


class Domain(train_settings.Group, frozen=True):
    """A list or a range from which a setting is drawn; integer ends mean a range of integers."""

    low: int | float | None = None
    """Smallest value."""
    high: int | float | None = None
    """Largest value."""
    log: bool = False
    """Whether the draw is uniform in the logarithm rather than in the value."""
    choices: Annotated[tuple[Any, ...], Field(min_length=2)] | None = None
    """Values of any kind, in place of a range."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.choices is not None:
            return self
        if self.low is None or self.high is None:
            raise SceneError([Problem("low, high", None, "must be given, or choices")])
        if self.low >= self.high:
            raise SceneError([Problem("high", self.high, f"must be greater than low, {self.low}")])
        if self.log and self.low <= 0:
            raise SceneError([Problem("low", self.low, "must be greater than 0 with log")])
        return self

    def drawn(self, key: str, trial: Any) -> Any:
        """Return the value of the setting `key` for an Optuna trial."""
        if self.choices is not None:
            # Optuna's storages accept strings and numbers but not lists.
            return json.loads(trial.suggest_categorical(key, list(map(json.dumps, self.choices))))
        whole = isinstance(self.low, int) and isinstance(self.high, int)
        suggest = trial.suggest_int if whole else trial.suggest_float
        return suggest(key, self.low, self.high, log=self.log)


class TuneSettings(train_settings.Group, frozen=True):
    """A search."""

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    """Name of the study, and of its folder under ``runs/``."""
    config: str
    """The training settings to vary: a file, or the name of one in ``configs/agents``."""
    settings: Annotated[dict[str, Any], Field(default_factory=dict)]
    """Changes to `config` in all trials, by dotted key."""
    space: Annotated[dict[str, Domain], Field(min_length=1)]
    """Settings that are drawn for each trial, by dotted key."""
    objective: Literal["score", "success_rate"] = "score"
    """What to maximise in a trial's last validation."""
    trials: train_settings.Count = 50
    """Total number of trials, including those of earlier calls and other processes."""
    pruner: Literal["median", "hyperband", "none"] = "median"
    """Optuna's rule that ends trials early."""
    startup_trials: train_settings.Count = 10
    """Number of trials drawn uniformly, before results guide draws and the median rule applies."""
    least_validations: train_settings.Count = 2
    """Number of validations before a trial can end early."""


@dataclass(frozen=True)
class Search:
    """A search whose settings have been checked."""

    settings: TuneSettings
    base: train_settings.TrainSettings
    """Settings common to all trials."""


def load_search(path: str, assignments: Sequence[str] = (), trials: int | None = None) -> Search:
    """Read and check a search.

    The search is the file at `path`, or the file of this name in ``configs/tuning``, with or
    without suffix. Training settings in `assignments`, such as ``learner.gamma=0.9``, apply to all
    trials; `trials` replaces the number in the file.

    Raises
    ------
    SettingsError
        If there is no such file, or something is not allowed in the search, in the settings it
        varies, or in a trial's settings at either end of a range.
    """
    content = io.read_mapping(train_settings.find_config(path, "tuning"), train_settings.GROUP)
    if trials is not None:
        content["trials"] = trials
    settings = train_settings.checked(TuneSettings, content, path)
    try:
        given = settings.settings | dict(map(train_settings.parse_assignment, assignments))
        base = train_settings.changed_settings(train_settings.load_settings(settings.config), given)
        envs.check_envs(base)
        for key, domain in settings.space.items():
            for value in domain.choices or (domain.low, domain.high):
                envs.check_envs(train_settings.changed_settings(base, {key: value}))
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from None
    return Search(settings, base)


def make_study(search: Search, storage: Any) -> Any:
    """Return the study, new or resumed, from one of Optuna's storages.

    Raises
    ------
    SettingsError
        If the storage holds another search of this name.
    """
    import optuna  # noqa: PLC0415 (an extra of its own)

    settings, base = search.settings, search.base
    least, startup = settings.least_validations, settings.startup_trials
    most = max(base.timesteps // base.validate_every, 1)
    pruners = {
        "median": lambda: optuna.pruners.MedianPruner(startup, least),
        "hyperband": lambda: optuna.pruners.HyperbandPruner(least, most),
        "none": optuna.pruners.NopPruner,
    }
    study = optuna.create_study(
        storage=storage,
        study_name=settings.name,
        sampler=optuna.samplers.TPESampler(n_startup_trials=startup),
        pruner=pruners[settings.pruner](),
        direction="maximize",
        load_if_exists=True,
    )
    key = settings.model_dump(mode="json", include={"name", "space", "objective"})
    key |= {"training": base.model_dump(mode="json"), "physics": physics_digest()}
    if where := difference(study.user_attrs.get("search", key), key):
        raise SettingsError(
            f"name: {settings.name!r} is the name of another stored search, {where}; "
            "give this one another name, --output or --storage"
        )
    study.set_user_attr("search", key)
    return study


def search_here(
    search: Search, output: Path, storage: str | None = None, minutes: float | None = None
) -> Any:
    """Run the remaining trials; return the study.

    The trials' runs are in `output`, and so is the database of the study, ``study.db``, unless
    `storage` is the SQLAlchemy address of another one. No new trial begins after `minutes`.

    Raises
    ------
    ValueError
        If `minutes` is not above 0, or the database cannot be opened or contains another search.
    """
    import optuna  # noqa: PLC0415
    import sqlalchemy.exc  # noqa: PLC0415 (a dependency of Optuna)

    errors.refuse([] if minutes is None else errors.unless_positive("minutes", minutes))
    settings = search.settings
    output.mkdir(parents=True, exist_ok=True)
    storage = storage or f"sqlite:///{output / 'study.db'}"
    # If several processes start together, only one may create the tables.
    with FileLock(output / "study.lock"), warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        again = optuna.storages.RetryHeartbeatStaleTrialCallback()
        try:
            database = optuna.storages.RDBStorage(
                storage, heartbeat_interval=HEARTBEAT, heartbeat_stale_trial_callback=again
            )
        except (sqlalchemy.exc.SQLAlchemyError, ImportError) as error:
            why = str(error).partition("\n")[0]
            allowed = f"must be the SQLAlchemy address of a database that can be opened; {why}"
            raise SettingsError(str(Problem("storage", storage, allowed))) from None
        study = make_study(search, database)

    def objective(trial: optuna.Trial) -> float:
        def watch(validation: int, result: dict[str, float]) -> None:
            trial.report(result[settings.objective], validation)
            if trial.should_prune():
                raise optuna.TrialPruned

        drawn = {key: domain.drawn(key, trial) for key, domain in settings.space.items()}
        folder = folder_of(trial, output)
        trial.set_user_attr("folder", folder.name)
        drawn["name"] = f"{settings.name}-{folder.name}"
        try:
            run.train(train_settings.changed_settings(search.base, drawn), folder, watch=watch)
        except run.DivergedError as error:
            raise optuna.TrialPruned(str(error)) from None
        except KeyboardInterrupt:
            again(study, study.trials[trial.number])
            raise
        info: Any = RunInfo.read(folder)
        return info.validation[settings.objective]

    ended = optuna.trial.TrialState.COMPLETE, optuna.trial.TrialState.PRUNED
    # Optuna would log a traceback of an error that the command reports.
    logging.getLogger("optuna.study._optimize").setLevel(logging.ERROR)
    if len(study.get_trials(states=ended)) < settings.trials:
        study.optimize(
            objective,
            timeout=None if minutes is None else 60.0 * minutes,
            callbacks=[optuna.study.MaxTrialsCallback(settings.trials, states=ended)],
        )
    return study


def folder_of(trial: Any, output: Path) -> Path:
    """Return the run folder of a trial; a trial that is queued again keeps its first folder."""
    return output / trial.user_attrs.get("folder", f"trial-{trial.number:04d}")


def report_best(study: Any, search: Search, output: Path) -> None:
    """Print the best trials; write the settings of the best one as those of a separate run."""
    settings = search.settings
    trials = [each for each in study.trials if each.state.name == "COMPLETE"]
    if not trials:
        typer.echo("no trial was completed")
        return
    trials.sort(key=attrgetter("value"), reverse=True)
    rows = [
        {"trial": folder_of(trial, output).name, settings.objective: f"{trial.value:.3f}"}
        | {
            key.split(".")[-1]: f"{drawn:.3g}" if isinstance(drawn, float) else str(drawn)
            for key, drawn in trial.params.items()
        }
        for trial in trials[:SHOWN]
    ]
    options.show(text_table(f"{settings.name}: the best of {len(trials)} complete trials", rows))
    best = train_settings.load_settings(folder_of(trials[0], output) / "settings.yaml")
    best = best.model_copy(update={"name": f"{settings.name}-best"})
    train_settings.save_settings(best, output / "best.yaml")
    typer.echo(f"the best settings, for python -m agents.train: {output / 'best.yaml'}")


def main(
    config: Annotated[str, typer.Argument(help="A YAML file, or a name in configs/tuning.")],
    trials: Annotated[int | None, typer.Option(help="Total number of trials.")] = None,
    minutes: Annotated[
        float | None, typer.Option(help="Time after which no new trial begins.")
    ] = None,
    assignments: Assignments = None,
    output: Annotated[Path | None, typer.Option(help="Folder; runs/NAME by default.")] = None,
    storage: Annotated[
        str | None,
        typer.Option(help="Database of the study; sqlite:///OUTPUT/study.db by default."),
    ] = None,
) -> None:
    """Train with settings drawn from ranges, and print the best; continue an interrupted search."""
    with needing("tune"):
        import optuna  # noqa: F401, PLC0415  # pyright: ignore[reportUnusedImport] (an extra, reported first)

        search = load_search(config, assignments or (), trials)
        folder = output or Path("runs") / search.settings.name
        report_best(search_here(search, folder, storage, minutes), search, folder)


if __name__ == "__main__":
    run_command(main)
