"""Trials of a search: ordinary training runs, and which of them were best."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from agents.settings.run import TrainSettings, changed_settings, load_settings, save_settings
from agents.training.info import RunInfo
from agents.training.run import DivergedError, Watch, train
from agents.tuning.settings import Drawn, Search

NOTHING = {"success_rate": 0.0, "score": 0.0}
"""What a run is worth whose numbers break down."""


class Trial(NamedTuple):
    """A trial that came to its end."""

    folder: Path
    value: float
    drawn: dict[str, Drawn]


def run_trial(settings: TrainSettings, folder: Path, watch: Watch) -> dict[str, float]:
    """Train in `folder`, or go on there; return the result of the last validation."""
    try:
        train(settings, folder, watch=watch)
    except DivergedError as error:
        Console(stderr=True).print(f"{folder.name}: {error}", highlight=False)
        return NOTHING
    info = RunInfo.read(folder)
    assert info is not None
    assert info.validation is not None, "every run ends with a validation"
    return info.validation


def tell_best(search: Search, trials: Sequence[Trial], output: Path) -> None:
    """Print the best trials; write the settings of the best as those of a run of its own."""
    console = Console()
    if not trials:
        console.print("no trial has come to its end")
        return
    console.print(best_table(search, trials))
    best = load_settings(max(trials, key=_value).folder / "settings.yaml")
    file = output / "best.yaml"
    save_settings(changed_settings(best, {"name": f"{search.settings.name}-best"}), file)
    console.print(f"the best settings, for python -m agents.train: {file}", soft_wrap=True)


def best_table(search: Search, trials: Sequence[Trial], count: int = 10) -> Table:
    """Return a table of the best trials, the best first."""
    settings = search.settings
    table = Table(title=f"{settings.name}: the best of {len(trials)} trials that ended")
    for name in ("trial", settings.objective, *(key.split(".")[-1] for key in settings.space)):
        table.add_column(name, overflow="fold")
    for trial in sorted(trials, key=_value, reverse=True)[:count]:
        values = (_text(trial.drawn[key]) for key in settings.space)
        table.add_row(trial.folder.name, f"{trial.value:.3f}", *values)
    return table


def _value(trial: Trial) -> float:
    return trial.value


def _text(drawn: Drawn) -> str:
    return f"{drawn:.3g}" if isinstance(drawn, float) else str(drawn)
