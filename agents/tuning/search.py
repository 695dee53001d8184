"""A search for hyper-parameters: its space, its trials and the best of them."""

import json
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import typer
from pydantic import Discriminator, Field, Tag, model_validator
from rich import table

from agents import settings as train_settings
from agents.commands import text_table
from agents.training import envs, run
from agents.training.folder import RunInfo
from magfold_env.cli import options
from magfold_env.scene import Problem, SceneError

Drawn = float | int | str
"""A value in Optuna's storage: a number, or a choice as JSON."""

NOTHING = {"success_rate": 0.0, "score": 0.0}
"""Result of a run whose numbers are not finite."""


class Interval(train_settings.Group, frozen=True):
    """Numbers in a range; whole numbers if both ends are written as whole numbers."""

    low: int | float
    """The smallest."""
    high: int | float
    """The largest."""
    log: bool = False
    """Whether the draw is uniform in the logarithm rather than in the value."""

    @property
    def ends(self) -> tuple[int | float, ...]:
        """Values that are checked before a search begins."""
        return self.low, self.high

    def read(self, drawn: Drawn) -> Any:
        """Return the value of the setting."""
        return drawn

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.low >= self.high:
            raise SceneError([Problem("high", self.high, f"must be greater than low, {self.low}")])
        if self.log and self.low <= 0:
            raise SceneError([Problem("low", self.low, "must be greater than 0 with log")])
        return self


class Choices(train_settings.Group, frozen=True):
    """One of several values of any kind."""

    choices: Annotated[tuple[Any, ...], Field(min_length=2)]
    """The values."""

    @property
    def ends(self) -> tuple[Any, ...]:
        """Values that are checked before a search begins."""
        return self.choices

    @property
    def texts(self) -> list[str]:
        """The values as JSON, because storages accept words and numbers but not lists."""
        return [json.dumps(value) for value in self.choices]

    def read(self, drawn: Drawn) -> Any:
        """Return the value of the setting."""
        return json.loads(str(drawn))


def _branch(value: Any) -> str:
    chosen = isinstance(value, Choices) or (isinstance(value, dict) and "choices" in value)
    return "<choices>" if chosen else "<interval>"


Domain = Annotated[
    Annotated[Interval, Tag("<interval>")] | Annotated[Choices, Tag("<choices>")],
    Discriminator(_branch),
]
"""The range or choice of a setting."""

Objective = Literal["score", "success_rate"]


class TuneSettings(train_settings.Group, frozen=True):
    """A search."""

    name: Annotated[str, Field(pattern=r"^[\w.-]+$")]
    """Name of the study, and of its folder under ``runs/``."""
    config: str
    """The varied training settings: a file or the name of one in ``configs/agents``."""
    settings: Annotated[dict[str, Any], Field(default_factory=dict)]
    """Settings that differ in all trials, by dotted key."""
    space: Annotated[dict[str, Domain], Field(min_length=1)]
    """Settings that are drawn for each trial, by dotted key."""
    objective: Objective = "score"
    """The result of a trial's last validation to maximise."""
    trials: train_settings.Count = 50
    """Total number of trials, including those of earlier calls and other processes."""
    pruner: Literal["median", "hyperband", "none"] = "median"
    """Rule that ends trials early that do worse than others after the same number of validations:
    those below the median of all, or all except the best third at each of a few stages."""
    startup_trials: train_settings.Count = 10
    """Number of uniformly drawn trials, before results guide the draws and the median applies."""
    least_validations: train_settings.Count = 2
    """Number of validations before a trial can end early."""


@dataclass(frozen=True)
class Search:
    """A checked search, and the runs it varies."""

    settings: TuneSettings
    """Settings of the search."""
    base: train_settings.TrainSettings
    """Settings common to all trials."""

    @property
    def key(self) -> dict[str, Any]:
        """Everything that must be equal for trials to be comparable."""
        own = self.settings.model_dump(mode="json", include={"name", "space", "objective"})
        return own | {"training": self.base.model_dump(mode="json")}

    @property
    def validations(self) -> int:
        """Number of validations of a complete trial."""
        return max(self.base.timesteps // self.base.validate_every, 1)

    def run_settings(self, drawn: Mapping[str, Drawn], trial: str) -> train_settings.TrainSettings:
        """Return the training settings of a trial from its draws and its name."""
        space = self.settings.space
        values = {key: space[key].read(value) for key, value in drawn.items()}
        return train_settings.changed_settings(
            self.base, {**values, "name": f"{self.settings.name}-{trial}"}
        )


def load_search(path: str, assignments: Sequence[str] = (), trials: int | None = None) -> Search:
    """Read and check a search.

    The search is the file at `path`, or the file of this name in ``configs/tuning``, with or
    without suffix. Training settings in `assignments`, such as ``learner.gamma=0.9``, apply to all
    trials; `trials` replaces their number in the file.

    Raises
    ------
    SettingsError
        If there is no such file, or something is not allowed in the search, in the settings it
        varies, or in those of a trial at either end of a range.
    """
    content = train_settings.read_mapping(train_settings.find_config(path, "tuning"))
    if trials is not None:
        content["trials"] = trials
    settings = train_settings.checked(TuneSettings, content, path)
    with _named_source(path, "settings"):
        given = settings.settings | dict(map(train_settings.parse_assignment, assignments))
        base = train_settings.changed_settings(train_settings.load_settings(settings.config), given)
        envs.check_envs(base)
    with _named_source(path, "space"):
        for key, domain in settings.space.items():
            for value in domain.ends:
                envs.check_envs(train_settings.changed_settings(base, {key: value}))
    search = Search(settings, base)
    if settings.least_validations > search.validations:
        allowed = f"must be at most {search.validations}, the validations of a trial"
        problem = Problem("least_validations", settings.least_validations, allowed)
        raise train_settings.SettingsError([problem], path)
    return search


@contextmanager
def _named_source(path: str, group: str) -> Generator[None]:
    """Name the file and the group of wrong training settings in errors."""
    try:
        yield
    except train_settings.SettingsError as error:
        raise train_settings.SettingsError(f"{path}: {group}: {error}") from None


class Trial(NamedTuple):
    """A completed trial."""

    folder: Path
    value: float
    drawn: dict[str, Drawn]


def run_trial(
    settings: train_settings.TrainSettings, folder: Path, watch: run.Watch
) -> dict[str, float]:
    """Train in `folder`, or resume there; return the result of the last validation."""
    try:
        run.train(settings, folder, watch=watch)
    except run.DivergedError as error:
        typer.echo(f"{folder.name}: {error}", err=True)
        return NOTHING
    info = RunInfo.read(folder)
    assert info is not None
    assert info.validation is not None, "every run ends with a validation"
    return info.validation


def report_best(search: Search, trials: Sequence[Trial], output: Path) -> None:
    """Print the best trials; write the settings of the best one as those of a separate run."""
    if not trials:
        typer.echo("no trial has come to its end")
        return
    options.show(best_table(search, trials))
    folder = max(trials, key=attrgetter("value")).folder
    best = train_settings.load_settings(folder / "settings.yaml")
    file = output / "best.yaml"
    train_settings.save_settings(
        train_settings.changed_settings(best, {"name": f"{search.settings.name}-best"}), file
    )
    typer.echo(f"the best settings, for python -m agents.train: {file}")


def best_table(search: Search, trials: Sequence[Trial], count: int = 10) -> table.Table:
    """Return a table of the best trials, the best first."""
    settings = search.settings
    best = sorted(trials, key=attrgetter("value"), reverse=True)[:count]
    rows = [
        {"trial": trial.folder.name, settings.objective: f"{trial.value:.3f}"}
        | {
            key.split(".")[-1]: f"{drawn:.3g}" if isinstance(drawn, float) else str(drawn)
            for key, drawn in ((key, trial.drawn[key]) for key in settings.space)
        }
        for trial in best
    ]
    return text_table(f"{settings.name}: the best of {len(trials)} trials that ended", rows)
